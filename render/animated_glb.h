#pragma once
/// A run as a binary glTF file with an animation: for Blender, and for viewers on the web.

#include <span>
#include <string>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns the file's bytes. Node 0 is a square of the ground, node 1 + i is body i with its visuals as
/// Renderer draws them. A camera follows: the scene's, or one that shows all that moves. Then lights
/// (KHR_lights_punctual): the scene's, or the default sun. The poses of `frames`, `interval` seconds apart,
/// are one animation of the moving bodies. Equal meshes are stored once. Frames end before the first that is
/// not finite.
std::string animated_glb(const Scene& scene, std::span<const std::vector<Coordinates>> frames,
                         double interval);

}  // namespace substep::render
