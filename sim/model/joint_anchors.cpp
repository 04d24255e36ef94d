#include "sim/model/joint_anchors.h"

#include <algorithm>
#include <array>

namespace substep {

bool holds_anchors_together(const Joint& joint) {
  return std::ranges::any_of(joint.limits, [](const JointLimit& limit) {
    return !limit.angular && limit.axes == std::array{true, true, true} && limit.min == 0 && limit.max == 0;
  });
}

}  // namespace substep
