#pragma once
/// Measures the gaps of joints.

#include <vector>

#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

/// Measures the gaps of a scene's joints: by how much a locked direction, a locked angle or a limit without
/// stiffness is beyond where the joint lets it be. Lengths count in m, and angles in rad times a lever: the
/// smaller one of the two bodies' largest radii of gyration about the joint, of those that can move. So an
/// angle counts as the way that it moves the lighter end's matter by.
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

/// The largest gap of the scene's joints, m. For many states make one JointGapMeter.
double joint_gap(const Scene& scene, const State& state);

}  // namespace substep
