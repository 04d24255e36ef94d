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

/// Buffers of all bodies. end() deletes OpenGL's names, while their context is current.
struct BodyBuffers {
  /// Consecutive parts that one call draws.
  struct Batch {
    std::size_t begin = 0;  ///< indices
    std::size_t end = 0;
    std::size_t first_body = 0;  ///< the body whose pose comes first in the program's blocks
    bool is_closed = false;
  };

  GLuint array = 0;
  /// Vertices, indices, each vertex's body within its batch, vertex looks; bodies' poses in the picture and
  /// in the world.
  std::array<GLuint, 6> buffers{};
  std::vector<Batch> batches;

  BodyBuffers() = default;
  explicit BodyBuffers(const BodyMesh& mesh);

  /// Draws all bodies with a program of shaders::body_places(). Of closed parts, faces that point away from
  /// the eye are left out; `hidden` is GL_FRONT where `clip_from_world` mirrors.
  void draw(GLuint program, const glm::dmat4& clip_from_world, std::span<const Coordinates> poses,
            GLenum hidden = GL_BACK) const;

  /// Draws the submeshes for which `shows` returns true, after it has set what their surfaces need, and the
  /// program where `program` is 0.
  void draw_pieces(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                   std::span<const Coordinates> poses, const std::function<bool(const Piece&)>& shows) const;

  /// Sets the poses of the bodies from `first` on, as many as a program's blocks take.
  void set_places(GLuint program, const glm::dmat4& clip_from_world, std::span<const Coordinates> poses,
                  std::size_t first) const;

  void end() const;
};

}  // namespace substep::render
