#pragma once
/// The smallest scene there is to measure on: one weight on one joint.

#include "sim/scene/scene.h"

namespace substep {

/// 1 kg without gravity, `height` m above a joint to the world that has the one limit.
Scene weight_on_a_joint(double height, const JointLimit& limit);

}  // namespace substep
