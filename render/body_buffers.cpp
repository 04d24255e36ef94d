#include "render/body_buffers.h"

#include <cstddef>
#include <glm/gtc/type_ptr.hpp>

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
  // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL takes places in its buffers as pointers.
  return reinterpret_cast<const void*>(bytes);
}

/// Where a program's body stands, and its code as a colour.
class Placement {
 public:
  explicit Placement(GLuint program)
      : clip_from_body_(glGetUniformLocation(program, "clip_from_body")),
        world_from_body_(glGetUniformLocation(program, "world_from_body")),
        color_(glGetUniformLocation(program, "color")) {}

  void set(std::size_t body, const glm::dmat4& clip_from_world, const Coordinates& q) const {
    const glm::dmat4 world = matrix(q);
    glUniformMatrix4fv(clip_from_body_, 1, GL_FALSE, glm::value_ptr(glm::mat4(clip_from_world * world)));
    if (world_from_body_ >= 0) {
      glUniformMatrix4fv(world_from_body_, 1, GL_FALSE, glm::value_ptr(glm::mat4(world)));
    }
    if (color_ >= 0) {
      const std::size_t code = body + 1;
      glUniform3f(color_, static_cast<float>(code & 0xff) / 255, static_cast<float>(code >> 8 & 0xff) / 255,
                  static_cast<float>(code >> 16 & 0xff) / 255);
    }
  }

 private:
  GLint clip_from_body_;
  GLint world_from_body_;
  GLint color_;
};

void draw_indices(std::size_t begin, std::size_t end) {
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(end - begin), GL_UNSIGNED_INT,
                 offset(begin * sizeof(std::uint32_t)));
}

}  // namespace

bool is_drawable(const Coordinates& q) {
  // Beyond this single precision turns bodies into noise.
  constexpr double farthest = 1e6;
  return q.linear.cwiseAbs().maxCoeff() < farthest && q.angular.coeffs().allFinite();
}

BodyBuffers::BodyBuffers(const BodyMesh& mesh) {
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  buffers = {
      buffer_of(GL_ARRAY_BUFFER, mesh.vertices.data(), mesh.vertices.size() * sizeof(Vertex)),
      buffer_of(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t)),
      0};
  const auto attribute = [](GLuint index, GLint count, std::size_t from, GLsizei stride) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, stride, offset(from));
  };
  attribute(0, 3, offsetof(Vertex, position), sizeof(Vertex));
  attribute(1, 3, offsetof(Vertex, normal), sizeof(Vertex));
  attribute(2, 3, offsetof(Vertex, color), sizeof(Vertex));
  attribute(3, 2, offsetof(Vertex, metallic), sizeof(Vertex));
  if (mesh.looks.empty()) return;
  buffers[2] = buffer_of(GL_ARRAY_BUFFER, mesh.looks.data(), mesh.looks.size() * sizeof(LookVertex));
  attribute(4, 4, offsetof(LookVertex, coordinates), sizeof(LookVertex));
  attribute(5, 4, offsetof(LookVertex, color), sizeof(LookVertex));
  attribute(6, 4, offsetof(LookVertex, tangent), sizeof(LookVertex));
  attribute(7, 2, offsetof(LookVertex, density), sizeof(LookVertex));
}

void BodyBuffers::draw(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                       std::span<const Coordinates> poses) const {
  glUseProgram(program);
  glBindVertexArray(array);
  const Placement placement(program);
  for (std::size_t i = 0; i + 1 < mesh.begin.size(); ++i) {
    if (mesh.begin[i + 1] == mesh.begin[i] || !is_drawable(poses[i])) continue;
    placement.set(i, clip_from_world, poses[i]);
    draw_indices(mesh.begin[i], mesh.begin[i + 1]);
  }
}

void BodyBuffers::draw_pieces(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                              std::span<const Coordinates> poses,
                              const std::function<bool(const Piece&)>& shows) const {
  glUseProgram(program);
  glBindVertexArray(array);
  const Placement placement(program);
  for (const Piece& piece : mesh.pieces) {
    if (!is_drawable(poses[piece.body]) || !shows(piece)) continue;
    placement.set(piece.body, clip_from_world, poses[piece.body]);
    draw_indices(piece.begin, piece.end);
  }
}

void BodyBuffers::end() const {
  glDeleteVertexArrays(1, &array);
  glDeleteBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
}

}  // namespace substep::render
