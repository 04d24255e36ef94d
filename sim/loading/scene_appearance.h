#pragma once
/// The appearance of a scene: surfaces, drawn meshes, cameras and lights.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns one surface per material, then one for meshes without; their images go to `images`.
std::vector<Surface> read_surfaces(GltfDocument& document, std::vector<SceneImage>& images,
                                   std::vector<std::string>& warnings);

/// Those of some vertices, in this order.
VertexLooks looks_of(const VertexLooks& looks, std::span<const std::uint32_t> vertices);

/// Returns the drawn triangles. Without normals each gets its own flat one, as glTF demands.
Mesh drawn_mesh(std::vector<Vector3> positions, std::vector<Vector3> normals, std::vector<Triangle> triangles,
                const std::string& name, int surface, VertexLooks looks = {});

/// Sets cameras and lights from the scene's nodes, in the order of the file: the first camera is the scene's,
/// the first directional light its sun.
void read_cameras_and_lights(const GltfDocument& document, Scene& scene);

}  // namespace substep
