#pragma once
/// The bodies' triangles on the device, and drawing them at poses.

#include <array>
#include <functional>
#include <glm/mat4x4.hpp>
#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "render/gl.h"
#include "sim/model/state.h"

namespace substep::render {

bool is_drawable(const Coordinates& q);

/// OpenGL's names are given back by end(), while their context is current.
struct BodyBuffers {
  /// Consecutive parts that one call draws.
  struct Batch {
    std::size_t begin = 0;  ///< indices
    std::size_t end = 0;
    std::size_t first_body = 0;  ///< whose place comes first in the program's blocks
    bool is_closed = false;
  };

  GLuint array = 0;
  /// Vertices, indices, each vertex's body within its batch, looks; bodies' places in the picture and in the
  /// world.
  std::array<GLuint, 6> buffers{};
  std::vector<Batch> batches;

  BodyBuffers() = default;
  explicit BodyBuffers(const BodyMesh& mesh);

  /// Draws all bodies with a program of shaders::body_places(). Of closed parts, faces that point away from
  /// the eye are left out; `hidden` is GL_FRONT where `clip_from_world` mirrors.
  void draw(GLuint program, const glm::dmat4& clip_from_world, std::span<const Coordinates> poses,
            GLenum hidden = GL_BACK) const;

  /// Draws the pieces that `shows` is true of, after it has set what their surfaces need; where `program` is
  /// 0, the program too.
  void draw_pieces(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                   std::span<const Coordinates> poses, const std::function<bool(const Piece&)>& shows) const;

  /// Sets the places of the bodies from `first` on, as many as a program's blocks take.
  void set_places(GLuint program, const glm::dmat4& clip_from_world, std::span<const Coordinates> poses,
                  std::size_t first) const;

  void end() const;
};

}  // namespace substep::render
