#pragma once
/// A scene's joints.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Once the bodies are placed. Throws Error.
void add_joints(SceneDraft& draft);

}  // namespace substep
