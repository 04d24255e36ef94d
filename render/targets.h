#pragma once
/// What is drawn to. OpenGL's names are given back by end(), while their context is current.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/gl.h"
#include "render/picture_areas.h"

namespace substep::render {

/// A colour and a depth buffer to draw to.
struct Target {
  GLuint framebuffer = 0;
  GLuint color = 0;
  GLuint depth = 0;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  Target() = default;
  Target(int w, int h);

  /// Makes it the target.
  void start() const;
  /// The same, and clears it.
  void start_anew() const;

  void read() { glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data()); }

  void end() const;
};

/// What is seen at each sample, for the light to be computed once however many triangles lie behind each
/// other or share the sample's neighbourhood.
struct Surfaces {
  GLuint framebuffer = 0;
  std::array<GLuint, 3>
      textures{};    ///< packed_surface() of shader_terms.cpp; the others where they were asked for
  GLuint depth = 0;  ///< texture
  int width = 0;
  int height = 0;

  Surfaces() = default;
  Surfaces(int w, int h, bool with_emission);

  /// Makes it the target, and clears its depth.
  void start() const;

  /// Clears what is seen, of the framebuffer that is drawn to: where nothing is drawn then, surfaces with
  /// looks have no normal.
  void clear() const;

  /// Copies `areas` of pixels, of so many samples a side, from one of the same size. Makes it the target.
  void copy(const Surfaces& from, std::span<const Rectangle> areas, int samples) const;

  void end() const;
};

/// The light from the surfaces, a pixel of `picture` each: of its first surface, of its second, and of both
/// what they cover. Its depth is the picture's.
struct Lit {
  GLuint framebuffer = 0;
  std::array<GLuint, 3> colors{};  ///< the last where it was asked for
  std::array<std::vector<std::uint8_t>, 3> pixels;

  Lit() = default;
  Lit(const Target& picture, bool with_opacities);

  void read(const Target& picture);

  void end() const;
};

/// Depths of two layers in turn, to draw the surfaces of one behind those of the other.
struct Layers {
  std::array<GLuint, 2> depths{};
  std::array<GLuint, 2> surfaces{};  ///< framebuffers: the textures of Surfaces, with these depths

  Layers() = default;
  explicit Layers(const Surfaces& shared);

  void end() const;
};

}  // namespace substep::render
