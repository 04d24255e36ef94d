#pragma once
/// A scene's drawn meshes, their surfaces and bodies.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Adds the drawn meshes, and moves them out of the draft; call it last. Throws Error.
void add_visuals(SceneDraft& draft);

}  // namespace substep
