#pragma once
/// The scene's images on the device. OpenGL's names are given back by end(), while their context is current.

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "render/gl.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// A texture as it is bound, and how many texels a unit of its coordinates is wide.
struct BoundTexture {
  GLuint texture = 0;
  GLuint sampler = 0;
  float texels = 1;
};

class SurfaceTextures {
 public:
  SurfaceTextures() = default;
  /// Decodes and uploads what the surfaces show. Throws Error where an image is damaged or too large.
  SurfaceTextures(const Scene& scene, const std::vector<Surface>& surfaces);

  /// Where the surface has none for the role, one texel that changes nothing.
  const BoundTexture& of(std::size_t surface, Surface::Role role) const {
    return bound_[surface][static_cast<std::size_t>(role)];
  }

  void end() const;

 private:
  GLuint uploaded(const Scene& scene, int image, bool is_color);
  GLuint sampler(const Texture& texture);

  std::vector<std::array<BoundTexture, 5>> bound_;
  std::map<std::pair<int, bool>, std::pair<GLuint, float>> textures_;  ///< by image and whether it is colour
  std::map<std::array<int, 5>, GLuint> samplers_;
  double texels_ = 0;  ///< uploaded so far
};

}  // namespace substep::render
