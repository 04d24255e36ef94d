#pragma once
/// results.json: every figure of a check, what approving would copy, and all that the report shows.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "golden/check/check.h"

namespace substep::golden {

/// A file that approving would copy over a golden, with the contents of both as the check saw them. In
/// results.json `from` is relative to the results' folder and `to` to the suite's: either may be moved.
struct ApprovalCandidate {
  std::filesystem::path from;
  std::string from_hash;
  std::filesystem::path to;
  std::string to_hash;  ///< empty: there was no such golden
};

struct CheckedCase {
  CaseResult result;
  std::vector<ApprovalCandidate> candidates;
  nlohmann::ordered_json sidecar;           ///< but for when and why it was approved
  nlohmann::ordered_json golden_made_with;  ///< of the goldens that it was checked against
};

/// Returns the path of `file`, which lies below `folder`, from there.
std::string below(const std::filesystem::path& file, const std::filesystem::path& folder);

std::filesystem::path results_file(const std::filesystem::path& output);

/// A case's part of results.json.
nlohmann::ordered_json to_json(const CheckedCase& checked);

/// Results without cases yet, which `ended` says.
nlohmann::ordered_json empty_results(const Suite& suite, const CheckOptions& options, std::size_t cases);

/// Adds what follows from the cases: totals and the exit code.
void sum_up(nlohmann::ordered_json& results);

void write_results(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Returns what write_results() wrote. Throws Error when there are no results, or others than it wrote.
nlohmann::ordered_json read_results(const std::filesystem::path& output);

}  // namespace substep::golden
