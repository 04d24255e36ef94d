#pragma once
/// The results of shards, put together.

#include <filesystem>
#include <vector>

namespace substep {

/// Reads the results of checks of one suite (CheckOptions::shard) and writes those of all to `output`:
/// results, report, junit.xml and the cases' files, so that approving goes by them. Returns the exit code of
/// a check of all. Throws Error when a case is in two of them, or they are of different suites.
int merge(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& output);

}  // namespace substep
