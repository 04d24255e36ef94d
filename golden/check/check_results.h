#pragma once
/// results.json: every figure of a check, the files that approving would copy, and the report's data.

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
  nlohmann::ordered_json sidecar;  ///< but for when and why it was approved
};

std::filesystem::path results_file(const std::filesystem::path& output);

/// Returns a case's part of results.json.
nlohmann::ordered_json to_json(const CheckedCase& checked);

/// Returns what a check wrote. Throws Error when there are no results, or they are damaged.
nlohmann::ordered_json read_results(const std::filesystem::path& output);

/// The folder that a check writes to. Results are written as cases end, and marked incomplete until the check
/// ends. No two checks write at once.
class CheckOutput {
 public:
  /// Makes the folder and removes stale results. Throws Error when another check writes there.
  explicit CheckOutput(std::filesystem::path folder);
  ~CheckOutput();
  CheckOutput(const CheckOutput&) = delete;
  CheckOutput& operator=(const CheckOutput&) = delete;

  void start(const Suite& suite, const CheckOptions& options, std::size_t cases);
  void set_made_with(const nlohmann::ordered_json& made_with) { results_["made_with"] = made_with; }
  void add_case(const nlohmann::ordered_json& entry);

  /// Marks the results complete, and writes them and the report.
  void finish(const std::vector<std::filesystem::path>& orphans);

  /// Writes a junit.xml that says why the check could not go on.
  void fail(const std::string& why) const;

 private:
  void write();

  std::filesystem::path folder_;
  int lock_ = -1;
  nlohmann::ordered_json results_;
  double last_written_ = -1e9;  ///< s
};

}  // namespace substep::golden
