#pragma once
/// Reads the known figures of a scene's motion from its file.

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// Sets `scene.expected` from `extras.substep.expected` of the document or of its default scene, whose list
/// counts where both give one. Bodies, gravity and duration must be there already. Throws Error.
void read_expectations(const GltfDocument& document, Scene& scene);

}  // namespace substep
