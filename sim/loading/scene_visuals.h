#pragma once
/// What is drawn of a scene: its surfaces and meshes, and which body carries each.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Last of all, once the bodies are placed: takes the draft's meshes. Throws Error.
void add_visuals(SceneDraft& draft);

}  // namespace substep
