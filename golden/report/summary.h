#pragma once
/// What a CI service shows of a check beside its report: summary.md, for GitHub's step summary or a comment,
/// and annotations.txt, workflow commands that GitHub puts beside the scenes' files when they are printed.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace substep {

/// Of what results.json holds. The summary's pictures are files of `output`, linked from there or, where they
/// are shown elsewhere, below `pictures_url`: GitHub shows no others.
void write_summary(const nlohmann::ordered_json& results, const std::filesystem::path& output,
                   const std::string& pictures_url = {});

std::filesystem::path summary_file(const std::filesystem::path& output);
std::filesystem::path annotations_file(const std::filesystem::path& output);

}  // namespace substep
