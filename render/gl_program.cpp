#include "render/gl_program.h"

#include <stdexcept>
#include <utility>

#include "render/units.h"

namespace substep::render {
namespace {

GLuint compile(GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const std::string whole = "#version 330 core\n" + source;
  const char* text = whole.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint success = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &success);
  if (success == GL_FALSE) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    throw std::logic_error("shader: " + log);
  }
  return shader;
}

}  // namespace

GLuint make_program(const std::string& vertex, const std::string& fragment) {
  const GLuint program = glCreateProgram();
  const GLuint vertex_shader = compile(GL_VERTEX_SHADER, vertex);
  const GLuint fragment_shader = compile(GL_FRAGMENT_SHADER, fragment);
  glAttachShader(program, vertex_shader);
  glAttachShader(program, fragment_shader);
  glLinkProgram(program);
  // They live on as parts of the program.
  glDeleteShader(vertex_shader);
  glDeleteShader(fragment_shader);
  GLint success = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &success);
  if (success == GL_FALSE) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    throw std::logic_error("shader program: " + log);
  }
  for (const auto& [name, block] :
       {std::pair("Frame", frame_block), std::pair("ClipPlaces", clip_places_block),
        std::pair("WorldPlaces", world_places_block)}) {
    const GLuint index = glGetUniformBlockIndex(program, name);
    if (index != GL_INVALID_INDEX) glUniformBlockBinding(program, index, block);
  }
  return program;
}

}  // namespace substep::render
