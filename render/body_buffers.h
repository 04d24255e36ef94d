#pragma once
/// The bodies' triangles on the device, and drawing them at poses.

#include <array>
#include <glm/mat4x4.hpp>
#include <span>

#include "render/body_mesh.h"
#include "render/gl.h"
#include "sim/model/state.h"

namespace substep {

bool is_drawable(const Coordinates& q);

/// OpenGL's names are given back by end(), while their context is current.
struct BodyBuffers {
  GLuint array = 0;
  std::array<GLuint, 2> buffers{};

  BodyBuffers() = default;
  explicit BodyBuffers(const BodyMesh& mesh);

  /// Sets those of the program's uniforms clip_from_body, world_from_body and color (the body's code) that it
  /// has. `mesh` is what was uploaded.
  void draw(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
            std::span<const Coordinates> poses) const;

  void end() const;
};

}  // namespace substep
