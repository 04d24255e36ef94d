#pragma once
/// The scene's images: uploaded to the device, or made smaller for a page that embeds them.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "render/gl.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// Returns how a texture is sampled, in OpenGL's numbers, which are glTF's: wrapping in both directions, the
/// filters for large and for small texels.
std::array<GLint, 4> sampling_of(const Texture& texture);

/// A texture to bind, and the number of texels in a unit of its coordinates.
struct BoundTexture {
  GLuint texture = 0;
  GLuint sampler = 0;
  float texels = 1;
};

/// The textures of a surface by Surface::Role; where it has none, one texel that changes nothing.
using SurfaceTextures = std::array<BoundTexture, 5>;

/// Decodes and uploads the images of the surfaces, and returns each surface's textures. Throws Error where an
/// image is damaged or too large.
std::vector<SurfaceTextures> upload_textures(Objects& objects, const Scene& scene,
                                             const std::vector<Surface>& surfaces);

struct ImageLimits {
  int longest = 512;            ///< pixels a side
  std::size_t bytes = 2000000;  ///< of all images' files together
};

/// Returns the scene with those of its images that `surfaces` show within the limits: halved until they are,
/// the largest first where together they have too many bytes, though none below 16 pixels. Images that are
/// small enough stay the same files. Throws Error where one is damaged.
Scene with_smaller_images(const Scene& scene, std::span<const Surface> surfaces, const ImageLimits& limits);

}  // namespace substep::render
