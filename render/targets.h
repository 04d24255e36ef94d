#pragma once
/// What is drawn to. OpenGL's names are given back by end(), while their context is current.

#include <array>
#include <cstdint>
#include <vector>

#include "render/gl.h"

namespace substep {

/// A colour and a depth buffer to draw to.
struct Target {
  GLuint framebuffer = 0;
  GLuint color = 0;
  GLuint depth = 0;  ///< with a stencil
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  Target() = default;
  Target(int w, int h);

  void start() const;

  void read() { glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data()); }

  void end() const;
};

/// What is seen at each sample, for the light to be computed once however many triangles lie behind each
/// other or share the sample's neighbourhood. Its stencil is 1 where a body is seen, and belongs to `target`
/// too.
struct Surfaces {
  GLuint framebuffer = 0;
  std::array<GLuint, 4> textures{};  ///< the last where it was asked for

  Surfaces() = default;
  Surfaces(const Target& target, bool with_emission);

  void end() const;
};

/// Depths of two layers in turn, to draw the surfaces of one behind those of the other.
struct Layers {
  std::array<GLuint, 2> depths{};
  std::array<GLuint, 2> surfaces{};  ///< framebuffers: the textures of Surfaces, with these depths
  std::array<GLuint, 2> lit{};       ///< the target's colour with these depths' stencils

  Layers() = default;
  Layers(const Target& target, const Surfaces& shared);

  void end() const;
};

}  // namespace substep
