#pragma once
/// A run as a binary glTF file with an animation: for Blender, and for viewers on the web.

#include <span>
#include <string>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns the file's bytes: a node a body with its visuals as Renderer draws them, a piece of the ground,
/// the scene's camera, or where it has none one that shows all that moves, its lights (KHR_lights_punctual),
/// and the poses of `frames`, `interval` seconds apart, as one animation of the bodies that move. Node 0 is
/// the ground, node 1 + i body i. Equal meshes are stored once. Frames end before the first that is not
/// finite.
std::string animated_glb(const Scene& scene, std::span<const std::vector<Coordinates>> frames,
                         double interval);

}  // namespace substep::render
