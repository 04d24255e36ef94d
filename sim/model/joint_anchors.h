#pragma once
/// The two points that a joint holds together.

#include "sim/scene/scene.h"

namespace substep {

/// Returns true where the joint keeps its frames' origins together: its three linear axes are locked.
bool holds_anchors_together(const Joint& joint);

}  // namespace substep
