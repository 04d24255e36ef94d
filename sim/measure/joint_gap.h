#pragma once
/// Measures the gaps of joints.

#include <vector>

#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

/// Measures the gaps of a scene's joints: the violation of a locked direction, a locked angle or a hard
/// limit. Lengths count in m, angles in rad times a lever, the smaller of the largest radii of gyration of
/// the joint's moving bodies about the joint. So an angle counts by the distance that it moves the lighter
/// end's mass.
class JointGapMeter {
 public:
  explicit JointGapMeter(const Scene& scene);

  /// True where no joint has a hard limit.
  bool is_empty() const { return held_.empty(); }
  /// Returns the largest gap, m.
  double gap(const State& state) const;

 private:
  struct Held {
    Attachment at;
    JointCoordinate coordinate;
    double low;
    double high;
    double scale;  ///< 1, or an angle's lever, m
  };
  std::vector<Held> held_;
};

/// Returns the largest gap of the scene's joints, m. For many states make one JointGapMeter.
double joint_gap(const Scene& scene, const State& state);

}  // namespace substep
