#pragma once
/// The report of a check: one HTML file that opens from disk, with everything in it.
///
/// It needs no network and no script: without scripts it is tables and pictures, with them each pair of
/// pictures can be slid, flickered and zoomed. Pictures are in the file until it would grow beyond
/// `largest_report`; those of the cases after that are linked to where the check left them.

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace substep::golden {

constexpr std::size_t largest_report = 10'000'000;  ///< bytes

std::filesystem::path report_file(const std::filesystem::path& output);

/// Writes the report of results.json, and reads the pictures that it names.
void write_report(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// The cases that fail with one verdict and one origin: a hundred failures of one origin are one line.
struct FailureGroup {
  std::string verdict;
  std::string origin;                                ///< "all cases of a3, no others, from frame 1 on"
  std::vector<const nlohmann::ordered_json*> cases;  ///< of results.json, the scene with fewest bodies first

  /// "27 cases, simulation changed: all cases of a3, no others, from frame 1 on; simplest: pendulum.a3".
  std::string line() const;
};

/// Groups the failures of results.json, which must outlive the groups. The gravest verdict comes first, then
/// the largest group.
std::vector<FailureGroup> failure_groups(const nlohmann::ordered_json& results);

// junit.xml: what CI services show of a check. Two tests a case, poses and images, as in the suite.

std::filesystem::path junit_file(const std::filesystem::path& output);

/// Writes the results. A case that could not be checked is an error; so are all cases left over by a check
/// that did not end.
void write_junit(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Writes one error for a check that could not begin or continue; `why` is its message.
void write_failed_junit(const std::string& why, const std::filesystem::path& output);

}  // namespace substep::golden
