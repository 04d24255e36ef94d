#pragma once
/// How far the algorithms' runs of one scene lie apart, before and after: whether a change brought one of
/// them nearer to the others.

#include <span>
#include <string>
#include <vector>

#include "sim/log/pose_log.h"

namespace substep {

struct DistanceMatrix {
  std::string scene;
  std::vector<std::string> cases;  ///< rows and columns, in the suite's order
  /// Root mean square over frames and bodies of the distance of centres, m, row by row; negative where runs
  /// cannot be compared. Golden runs against golden runs, then new runs against new ones.
  std::vector<double> before;
  std::vector<double> after;
};

/// Over the frames that both logs have in full. Negative when there are none or the bodies differ.
double run_distance(const PoseLog& a, const PoseLog& b);

/// Of all logs with each other, row by row; a null log has no distance.
std::vector<double> run_distances(std::span<const PoseLog* const> logs);

}  // namespace substep
