#pragma once
/// Reads the appearance of a scene: surfaces, rendered meshes, cameras and lights.

#include <vector>

#include "sim/loading/gltf_document.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns one surface per material, then one for meshes without a material. Appends their images to
/// `images`.
std::vector<Surface> read_surfaces(GltfDocument& document, std::vector<SceneImage>& images);

/// Sets cameras and lights from the scene's nodes, in the order of the file: the first camera is the scene's,
/// the first directional light its sun.
void read_cameras_and_lights(const GltfDocument& document, Scene& scene);

/// Computed normals of a mesh that has none.
enum class Shading {
  flat,     ///< each triangle has its own, as glTF demands
  creased,  ///< a corner's is the mean, by area, of its triangles whose normals differ by < 40°
};

/// Returns the mesh with its own or computed normals. With computed ones each triangle has its own vertices,
/// and triangles without area are left out.
Mesh with_normals(Mesh mesh, Shading shading);

}  // namespace substep
