#pragma once
/// What a scene looks like: surfaces, drawn meshes, camera and light.

#include <string>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// One surface per material, and after them one for meshes that have none.
std::vector<Surface> read_surfaces(const GltfDocument& document, std::vector<std::string>& warnings);

/// Triangles as they are drawn. Without normals each gets its own flat one, as glTF asks.
Mesh drawn_mesh(std::vector<Vector3> positions, std::vector<Vector3> normals, std::vector<Triangle> triangles,
                const std::string& name, int surface);

/// Sets the camera and the sun from the first camera and the first directional light among the scene's nodes,
/// in the order of the file.
void read_camera_and_sun(const GltfDocument& document, Scene& scene);

}  // namespace substep
