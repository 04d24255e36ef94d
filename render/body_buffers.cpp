#include "render/body_buffers.h"

#include <cstddef>
#include <glm/gtc/type_ptr.hpp>

namespace substep {
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
      buffer_of(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t))};
  const auto attribute = [](GLuint index, GLint count, std::size_t from) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(from));
  };
  attribute(0, 3, offsetof(Vertex, position));
  attribute(1, 3, offsetof(Vertex, normal));
  attribute(2, 3, offsetof(Vertex, color));
  attribute(3, 2, offsetof(Vertex, metallic));
}

void BodyBuffers::draw(const BodyMesh& mesh, GLuint program, const glm::dmat4& clip_from_world,
                       std::span<const Coordinates> poses) const {
  glUseProgram(program);
  glBindVertexArray(array);
  const GLint clip_from_body = glGetUniformLocation(program, "clip_from_body");
  const GLint world_from_body = glGetUniformLocation(program, "world_from_body");
  const GLint color = glGetUniformLocation(program, "color");
  for (std::size_t i = 0; i + 1 < mesh.begin.size(); ++i) {
    const std::size_t count = mesh.begin[i + 1] - mesh.begin[i];
    if (count == 0 || !is_drawable(poses[i])) continue;
    const glm::dmat4 world = matrix(poses[i]);
    glUniformMatrix4fv(clip_from_body, 1, GL_FALSE, glm::value_ptr(glm::mat4(clip_from_world * world)));
    if (world_from_body >= 0) {
      glUniformMatrix4fv(world_from_body, 1, GL_FALSE, glm::value_ptr(glm::mat4(world)));
    }
    if (color >= 0) {
      const std::size_t code = i + 1;
      glUniform3f(color, static_cast<float>(code & 0xff) / 255, static_cast<float>(code >> 8 & 0xff) / 255,
                  static_cast<float>(code >> 16 & 0xff) / 255);
    }
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT,
                   offset(mesh.begin[i] * sizeof(std::uint32_t)));
  }
}

void BodyBuffers::end() const {
  glDeleteVertexArrays(1, &array);
  glDeleteBuffers(2, buffers.data());
}

}  // namespace substep
