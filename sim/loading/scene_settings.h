#pragma once
/// Reads `extras.substep`, which holds what glTF's extensions lack.

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// Sets gravity, duration, step and gyroscopic from `extras.substep` of the document and of its default
/// scene; the scene's wins where both give a key. Throws Error on an unknown key. What is expected of bodies
/// is read once these are there: scene_expectations.h.
void read_settings(const GltfDocument& document, Scene& scene);

/// Sets substeps: `extras.substep.substeps`, else needed_substeps() of the bodies and joints, which are there
/// by then.
void read_substeps(const GltfDocument& document, Scene& scene);

}  // namespace substep
