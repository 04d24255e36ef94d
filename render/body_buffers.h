#pragma once
/// The bodies' triangles on the device, and drawing them at poses.

#include <array>
#include <functional>
#include <glm/mat4x4.hpp>
#include <span>

#include "render/body_mesh.h"
#include "render/gl.h"
#include "sim/model/state.h"

namespace substep::render {

bool is_drawable(const Coordinates& q);

/// OpenGL's names are given back by end(), while their context is current.
struct BodyBuffers {
  GLuint array = 0;
  std::array<GLuint, 3> buffers{};  ///< vertices, indices, looks

  BodyBuffers() = default;
  explicit BodyBuffers(const BodyMesh& mesh);

  /// Sets those of the program's uniforms clip_from_body, world_from_body and color (the body's code) that it
  /// has. `mesh` is what was uploaded.
  void draw(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
            std::span<const Coordinates> poses) const;

  /// Draws the pieces that `shows` is true of, after it has set what their surfaces need.
  void draw_pieces(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                   std::span<const Coordinates> poses, const std::function<bool(const Piece&)>& shows) const;

  void end() const;
};

}  // namespace substep::render
