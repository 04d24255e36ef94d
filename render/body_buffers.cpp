#include "render/body_buffers.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "render/shaders.h"
#include "render/units.h"

namespace substep::render {
namespace {

glm::dmat4 matrix(const Coordinates& q) {
  const Matrix3 rotation = q.angular.toRotationMatrix();
  glm::dmat4 result(1);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) result[column][row] = rotation(row, column);
    result[3][column] = q.linear[column];
  }
  return result;
}

GLuint buffer_of(GLenum target, const void* data, std::size_t bytes) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(target, buffer);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  return buffer;
}

const void* offset(std::size_t bytes) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL takes offsets in its buffers as pointers.
  return reinterpret_cast<const void*>(bytes);
}

void draw_indices(std::size_t begin, std::size_t end) {
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(end - begin), GL_UNSIGNED_INT,
                 offset(begin * sizeof(std::uint32_t)));
}

}  // namespace

bool is_drawable(const Coordinates& q) {
  // Limit beyond which single precision turns bodies into noise.
  constexpr double farthest = 1e6;
  return q.linear.cwiseAbs().maxCoeff() < farthest && q.angular.coeffs().allFinite();
}

BodyBuffers::BodyBuffers(const BodyMesh& mesh) {
  std::vector<std::uint16_t> bodies(mesh.vertices.size());
  for (const Part& part : mesh.parts) {
    const std::size_t body = static_cast<std::size_t>(part.body);
    const std::size_t first = body / shaders::bodies_at_once * shaders::bodies_at_once;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      bodies[mesh.indices[i]] = static_cast<std::uint16_t>(body - first);
    }
    if (!batches.empty() && batches.back().first_body == first &&
        batches.back().is_closed == part.is_closed) {
      batches.back().end = part.end;
    } else {
      batches.push_back({part.begin, part.end, first, part.is_closed});
    }
  }
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  const auto attribute = [](GLuint index, GLint count, std::size_t from, GLsizei stride,
                            GLenum type = GL_FLOAT) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, type, GL_FALSE, stride, offset(from));
  };
  buffers[0] = buffer_of(GL_ARRAY_BUFFER, mesh.vertices.data(), mesh.vertices.size() * sizeof(Vertex));
  attribute(0, 3, offsetof(Vertex, position), sizeof(Vertex));
  attribute(1, 3, offsetof(Vertex, normal), sizeof(Vertex));
  attribute(2, 3, offsetof(Vertex, color), sizeof(Vertex));
  attribute(3, 2, offsetof(Vertex, metallic), sizeof(Vertex));
  buffers[1] =
      buffer_of(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
  buffers[2] = buffer_of(GL_ARRAY_BUFFER, bodies.data(), bodies.size() * sizeof(std::uint16_t));
  attribute(8, 1, 0, sizeof(std::uint16_t), GL_UNSIGNED_SHORT);
  glGenBuffers(2, &buffers[4]);
  if (mesh.looks.empty()) return;
  buffers[3] = buffer_of(GL_ARRAY_BUFFER, mesh.looks.data(), mesh.looks.size() * sizeof(LookVertex));
  attribute(4, 4, offsetof(LookVertex, coordinates), sizeof(LookVertex));
  attribute(5, 4, offsetof(LookVertex, color), sizeof(LookVertex));
  attribute(6, 4, offsetof(LookVertex, tangent), sizeof(LookVertex));
  attribute(7, 2, offsetof(LookVertex, density), sizeof(LookVertex));
}

void BodyBuffers::set_places(GLuint program, const glm::dmat4& clip_from_world,
                             std::span<const Coordinates> poses, std::size_t first) const {
  // Move bodies that cannot be drawn beside the picture.
  glm::mat4 beside(0);
  beside[3] = {2, 2, 0, 1};
  std::vector<glm::mat4> in_clip(shaders::bodies_at_once, beside);
  std::vector<glm::mat4> in_world(shaders::bodies_at_once, glm::mat4(0));
  for (std::size_t i = first; i < std::min(poses.size(), first + shaders::bodies_at_once); ++i) {
    if (!is_drawable(poses[i])) continue;
    const glm::dmat4 world = matrix(poses[i]);
    in_world[i - first] = glm::mat4(world);
    in_clip[i - first] = glm::mat4(clip_from_world * world);
  }
  const std::array<const std::vector<glm::mat4>*, 2> blocks{&in_clip, &in_world};
  for (GLuint block = 0; block < 2; ++block) {
    glBindBuffer(GL_UNIFORM_BUFFER, buffers[4 + block]);
    glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(shaders::bodies_at_once * sizeof(glm::mat4)),
                 blocks[block]->data(), GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, clip_places_block + block, buffers[4 + block]);
  }
  if (program != 0) glUniform1i(glGetUniformLocation(program, "first_body"), static_cast<GLint>(first));
}

void BodyBuffers::draw(GLuint program, const glm::dmat4& clip_from_world, std::span<const Coordinates> poses,
                       GLenum hidden) const {
  glUseProgram(program);
  glBindVertexArray(array);
  glCullFace(hidden);
  const Batch* last = nullptr;
  for (const Batch& batch : batches) {
    if (last == nullptr || last->first_body != batch.first_body) {
      set_places(program, clip_from_world, poses, batch.first_body);
    }
    last = &batch;
    if (batch.is_closed) glEnable(GL_CULL_FACE);
    draw_indices(batch.begin, batch.end);
    glDisable(GL_CULL_FACE);
  }
}

void BodyBuffers::draw_pieces(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                              std::span<const Coordinates> poses,
                              const std::function<bool(const Piece&)>& shows) const {
  if (program != 0) glUseProgram(program);
  glBindVertexArray(array);
  std::optional<std::size_t> set;
  for (const Piece& piece : mesh.pieces) {
    if (!is_drawable(poses[piece.body]) || !shows(piece)) continue;
    const std::size_t first = piece.body / shaders::bodies_at_once * shaders::bodies_at_once;
    if (set != first) set_places(program, clip_from_world, poses, first);
    set = first;
    draw_indices(piece.begin, piece.end);
  }
}

void BodyBuffers::end() const {
  glDeleteVertexArrays(1, &array);
  glDeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
}

}  // namespace substep::render
