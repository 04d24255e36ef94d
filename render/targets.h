#pragma once
/// Framebuffers. Their OpenGL objects belong to the Objects that they are made with.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/gl.h"
#include "render/picture_areas.h"

namespace substep::render {

/// Returns a new framebuffer, which becomes the current one.
GLuint bound_framebuffer(Objects& objects);

/// Attaches the textures before the first 0 and a new depth texture to the current framebuffer. Returns the
/// depth texture.
GLuint attach_textures(Objects& objects, const std::array<GLuint, 3>& textures, int width, int height);

/// A colour and a depth buffer to draw to.
struct Target {
  GLuint framebuffer = 0;
  GLuint depth = 0;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;

  Target() = default;
  Target(Objects& objects, int w, int h);

  void start() const;       ///< binds the framebuffer and sets the viewport
  void start_anew() const;  ///< clears too

  void read() { glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data()); }
};

/// A G-buffer: the nearest surface at each sample. Light is computed later, for visible surfaces alone.
struct Surfaces {
  GLuint framebuffer = 0;
  /// packed_surface() of shader_terms.cpp; `with_emission` also emission with alpha, and crevices.
  std::array<GLuint, 3> textures{};
  GLuint depth = 0;  ///< texture
  int width = 0;
  int height = 0;

  Surfaces() = default;
  Surfaces(Objects& objects, int w, int h, bool with_emission);
  /// Has the textures of `shared`, and a depth of its own.
  Surfaces(Objects& objects, const Surfaces& shared);

  /// Binds the framebuffer, sets the viewport and clears the depth.
  void start() const;

  /// Clears the surfaces of the current framebuffer to 0, no normal. Scenes with materials of their own need
  /// it where nothing is drawn.
  static void clear();

  /// Copies `areas`, in pixels of `samples` × `samples` samples, from surfaces of the same size. `buffers`:
  /// OpenGL's mask. Makes these surfaces the target.
  void copy(const Surfaces& from, std::span<const Rectangle> areas, int samples, GLbitfield buffers) const;
};

/// Buffers of a picture's size: the light of each pixel's first surface, that of its second and, if
/// requested, both opacities. Shares the picture's depth.
struct LightingBuffer {
  GLuint framebuffer = 0;
  std::array<std::vector<std::uint8_t>, 3> pixels;

  LightingBuffer() = default;
  LightingBuffer(Objects& objects, const Target& picture, bool with_opacities);

  void read(const Target& picture);
};

}  // namespace substep::render
