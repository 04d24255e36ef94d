#pragma once
/// The results of shards, put together.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

namespace substep {

/// Reads the results of checks of one suite (CheckOptions::shard) and writes those of all to `output`:
/// results, report, junit.xml and the cases' files, so that approving goes by them. One folder is all of its
/// check's parts when that was not divided: so results that were moved here get commands that hold here.
/// `suite` is the suite's file or folder here; empty: where the shards say it is.
///
/// A part that is missing, or whose check did not end, is named in "missing" of the results that are
/// returned, and the others are there. Throws Error when a part is there twice, or they are not of one suite.
nlohmann::ordered_json merge(const std::vector<std::filesystem::path>& shards,
                             const std::filesystem::path& output, const std::filesystem::path& suite = {});

}  // namespace substep
