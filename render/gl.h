#pragma once
/// Function pointers of OpenGL by their own names. context_osmesa.cpp sets them when it makes the first
/// context, so that only programs that draw load the library with all of LLVM.

#ifndef GL_GLEXT_PROTOTYPES
#define GL_GLEXT_PROTOTYPES
#endif
#include <GL/gl.h>
#include <GL/glext.h>

// One that is used and not listed is an undefined reference when the program is linked.
// clang-format off
#define SUBSTEP_GL_FUNCTIONS(X) \
  X(glActiveTexture) X(glAttachShader) X(glBeginQuery) X(glBindBuffer) X(glBindBufferBase) \
  X(glBindFramebuffer) X(glBindRenderbuffer) X(glBindSampler) X(glBindTexture) X(glBindVertexArray) \
  X(glBlitFramebuffer) X(glBufferData) X(glCheckFramebufferStatus) X(glClear) X(glClearBufferiv) X(glClearColor) \
  X(glCompileShader) X(glCreateProgram) X(glCreateShader) X(glCullFace) X(glDeleteBuffers) X(glDeleteFramebuffers) \
  X(glDeleteQueries) X(glDeleteRenderbuffers) X(glDeleteSamplers) X(glDeleteShader) X(glDeleteTextures) \
  X(glDeleteVertexArrays) X(glDepthFunc) X(glDepthMask) X(glDisable) X(glDrawArrays) X(glDrawBuffer) \
  X(glDrawBuffers) X(glDrawElements) X(glEnable) X(glEnableVertexAttribArray) X(glEndQuery) \
  X(glFramebufferRenderbuffer) X(glFramebufferTexture2D) X(glGenBuffers) X(glGenFramebuffers) \
  X(glGenQueries) X(glGenRenderbuffers) X(glGenSamplers) X(glGenTextures) X(glGenVertexArrays) X(glGetError) \
  X(glGetProgramInfoLog) X(glGetProgramiv) X(glGetQueryObjectuiv) X(glGetShaderInfoLog) X(glGetShaderiv) \
  X(glGetString) X(glGetUniformBlockIndex) X(glGetUniformLocation) X(glLinkProgram) X(glPolygonOffset) \
  X(glReadBuffer) X(glReadPixels) X(glRenderbufferStorage) X(glSamplerParameterfv) X(glSamplerParameteri) \
  X(glScissor) X(glShaderSource) X(glTexImage2D) X(glTexSubImage2D) X(glUniform1f) \
  X(glUniform1i) X(glUniform2f) X(glUniform3f) X(glUniform4f) X(glUniform4fv) X(glUniformBlockBinding) \
  X(glUniformMatrix4fv) X(glUseProgram) X(glVertexAttribPointer) X(glViewport)
// clang-format on

namespace substep::render {

// A name that is declared has no parentheses about it.
// NOLINTNEXTLINE(bugprone-macro-parentheses)
#define SUBSTEP_GL_POINTER(name) inline decltype(&::name) name = nullptr;
SUBSTEP_GL_FUNCTIONS(SUBSTEP_GL_POINTER)
#undef SUBSTEP_GL_POINTER

}  // namespace substep::render
