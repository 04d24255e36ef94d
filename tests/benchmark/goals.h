#pragma once
/// The project's goals for speed, and how far this run is from each.

#include <string>
#include <vector>

#include "tests/benchmark/measurement.h"

namespace substep::benchmark {

struct Goal {
  std::string about;
  std::string what;
  double ratio;  ///< measured
  double limit;
  bool at_least = false;  ///< the ratio should not be below the limit; else not above it
  std::string remark;     ///< who failed its check
};

/// Those that this run measured both sides of.
std::vector<Goal> goals(const Results& results);

std::string lines(const std::vector<Goal>& goals);
std::string markdown(const std::vector<Goal>& goals);

}  // namespace substep::benchmark
