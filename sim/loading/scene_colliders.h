#pragma once
/// A scene's colliders, each in the frame of its body's node.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Adds the colliders; call it after the bodies. Throws Error.
void add_colliders(SceneDraft& draft);

}  // namespace substep
