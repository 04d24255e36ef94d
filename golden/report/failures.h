#pragma once
/// The failures of a check, from results.json, as terminal and page show them.
///
/// Printed commands are relative to the user's working folder, since results may move after a check.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/loading/json_value.h"

namespace substep::golden {

/// The suite that was checked and the folder of its results, as commands name them.
struct ResultsLocation {
  std::filesystem::path suite;
  std::filesystem::path output;
};

/// Returns the paths for printed commands: relative where they are below the working folder, so that the
/// command also works in a clone on another machine.
ResultsLocation location_of(const Json& results, const std::filesystem::path& output);

/// Returns the command that approves a case, from its part of results.json: "substep approve box_stack.a4
/// --reason \"...\""; empty where it cannot be approved from there.
std::string approve_command(const Json& entry, const ResultsLocation& location);

/// Returns the printed text of a failing case: its text in results.json, then the command.
std::string explanation(const Json& entry, const ResultsLocation& location);

/// Returns `word` quoted, so that a shell takes it as one word.
std::string shell_word(const std::string& word);

/// The cases that fail with one verdict and one origin: a hundred failures of one origin are one line.
struct FailureGroup {
  std::string verdict;
  std::string origin;              ///< "all cases of a3, from frame 1 on"
  std::vector<const Json*> cases;  ///< of results.json, the scene with fewest bodies first

  /// "27 cases, simulation changed: all cases of a3, from frame 1 on; simplest: pendulum.a3".
  std::string line() const;
};

/// Groups the failures of results.json, which must outlive the groups. The gravest verdict comes first, then
/// the largest group.
std::vector<FailureGroup> failure_groups(const Json& results);

}  // namespace substep::golden
