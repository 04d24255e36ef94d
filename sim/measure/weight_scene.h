#pragma once
/// The smallest scene to measure: one weight on one joint.

#include "sim/scene/scene.h"

namespace substep {

/// Returns a scene of 1 kg without gravity, `height` m above a joint to the world with one limit.
Scene weight_on_a_joint(double height, const JointLimit& limit);

}  // namespace substep
