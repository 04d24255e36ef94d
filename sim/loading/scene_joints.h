#pragma once
/// A scene's joints.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Adds the joints; call it after place_bodies(). Throws Error.
void add_joints(SceneDraft& draft);

}  // namespace substep
