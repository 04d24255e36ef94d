#pragma once
/// What a run of a scene takes unless told otherwise.

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

/// default_settings() with the scene's step. The report's five get its sub-steps n too; A2 gets n iterations,
/// as many row solves.
Settings usual_settings(const Scene& scene, Algorithm algorithm);

}  // namespace substep
