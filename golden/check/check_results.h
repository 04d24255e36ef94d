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

/// What was checked, as approve() needs it.
struct CheckResults {
  std::string suite_hash;
  struct Case {
    std::string name;
    std::string verdict;
    std::string refusal;
    std::filesystem::path sidecar_file;
    std::vector<ApprovalCandidate> candidates;
    nlohmann::ordered_json sidecar;
  };
  std::vector<Case> cases;
  struct Orphan {
    std::filesystem::path file;
    std::string hash;
  };
  std::vector<Orphan> orphans;
  nlohmann::ordered_json made_with;
};

std::filesystem::path results_file(const std::filesystem::path& output);

/// A case's part of results.json.
nlohmann::ordered_json to_json(const CheckedCase& checked);

/// A golden of no case: its file below the suite's folder, its content's hash and, where a new case moves
/// just as it says, that case's name: it was renamed.
nlohmann::ordered_json orphan_json(const std::filesystem::path& file,
                                   const std::filesystem::path& suite_folder,
                                   const nlohmann::ordered_json& cases);

/// Results without cases yet, which `ended` says.
nlohmann::ordered_json empty_results(const Suite& suite, const CheckOptions& options, std::size_t cases);

/// Adds what follows from the cases: totals and the exit code.
void sum_up(nlohmann::ordered_json& results);

void write_results(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Throws Error when there are none, or they are not what write_results wrote.
nlohmann::ordered_json read_results_json(const std::filesystem::path& output);
/// `suite_folder` is where the goldens are.
CheckResults read_results(const std::filesystem::path& output, const std::filesystem::path& suite_folder);

}  // namespace substep::golden
