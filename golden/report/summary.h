#pragma once
/// What a CI service shows of a check beside its report: summary.md, for GitHub's step summary or a comment,
/// and annotations.txt, workflow commands that GitHub puts beside the scenes' files when they are printed.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace substep {

/// Of what results.json holds. The summary links its pictures as files of `output`: where it is shown
/// elsewhere they are to be put somewhere, for GitHub shows none that stand in the text itself.
void write_summary(const nlohmann::ordered_json& results, const std::filesystem::path& output);

std::filesystem::path summary_file(const std::filesystem::path& output);
std::filesystem::path annotations_file(const std::filesystem::path& output);

}  // namespace substep
