#pragma once
/// The cases that fail, by what they have in common: a hundred failures of one origin are one line.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace substep::golden {

struct FailureGroup {
  std::string verdict;
  std::string origin;                                ///< "all cases of a3, no others, from frame 1 on"
  std::vector<const nlohmann::ordered_json*> cases;  ///< of results.json, the scene with fewest bodies first

  /// "27 cases, simulation changed: all cases of a3, no others, from frame 1 on; simplest: pendulum.a3".
  std::string line() const;
};

/// Of what results.json holds, which must outlive them. The gravest verdict first, then the largest group.
std::vector<FailureGroup> failure_groups(const nlohmann::ordered_json& results);

}  // namespace substep::golden
