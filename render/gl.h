#pragma once
/// Software OpenGL without a window: its functions by their own names, contexts, programs and objects.
///
/// The functions are pointers, which the first context sets, so that only programs that draw load the library
/// with all of LLVM.

#ifndef GL_GLEXT_PROTOTYPES
#define GL_GLEXT_PROTOTYPES
#endif
#include <GL/gl.h>
#include <GL/glext.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

// A function that is used and not listed is an undefined reference when the program is linked.
// clang-format off
#define SUBSTEP_GL_FUNCTIONS(X) \
  X(glActiveTexture) X(glAttachShader) X(glBeginQuery) X(glBindBuffer) X(glBindBufferBase) \
  X(glBindFramebuffer) X(glBindRenderbuffer) X(glBindSampler) X(glBindTexture) X(glBindVertexArray) \
  X(glBlitFramebuffer) X(glBufferData) X(glCheckFramebufferStatus) X(glClear) X(glClearBufferiv) X(glClearColor) \
  X(glCompileShader) X(glCreateProgram) X(glCreateShader) X(glCullFace) X(glDeleteBuffers) X(glDeleteFramebuffers) \
  X(glDeleteQueries) X(glDeleteRenderbuffers) X(glDeleteSamplers) X(glDeleteShader) X(glDeleteTextures) \
  X(glDeleteVertexArrays) X(glDepthFunc) X(glDisable) X(glDrawArrays) \
  X(glDrawBuffers) X(glDrawElements) X(glEnable) X(glEnableVertexAttribArray) X(glEndQuery) \
  X(glFramebufferRenderbuffer) X(glFramebufferTexture2D) X(glGenBuffers) X(glGenFramebuffers) \
  X(glGenQueries) X(glGenRenderbuffers) X(glGenSamplers) X(glGenTextures) X(glGenVertexArrays) X(glGetError) \
  X(glGetProgramInfoLog) X(glGetProgramiv) X(glGetQueryObjectuiv) X(glGetShaderInfoLog) X(glGetShaderiv) \
  X(glGetString) X(glGetUniformBlockIndex) X(glGetUniformLocation) X(glLinkProgram) X(glPolygonOffset) \
  X(glReadBuffer) X(glReadPixels) X(glRenderbufferStorage) X(glSamplerParameterfv) X(glSamplerParameteri) \
  X(glScissor) X(glShaderSource) X(glTexImage2D) X(glTexSubImage2D) X(glUniform1f) \
  X(glUniform1i) X(glUniform2f) X(glUniform4fv) X(glUniformBlockBinding) \
  X(glUseProgram) X(glVertexAttribPointer) X(glViewport)
// clang-format on

struct osmesa_context;

namespace substep::render {

// A name that is declared has no parentheses about it.
// NOLINTNEXTLINE(bugprone-macro-parentheses)
#define SUBSTEP_GL_POINTER(name) inline decltype(&::name) name = nullptr;
SUBSTEP_GL_FUNCTIONS(SUBSTEP_GL_POINTER)
#undef SUBSTEP_GL_POINTER

/// A context whose drawing all goes to framebuffer objects. Objects made in the context live until it ends.
class Context {
 public:
  /// Throws Error when there is no software OpenGL of at least 3.3.
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Waits until no other thread has the context, then makes it the calling thread's for its own lifetime.
  /// The driver would let two threads draw and mix them up.
  class Current {
   public:
    explicit Current(Context& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    std::lock_guard<std::mutex> lock_;
  };

 private:
  osmesa_context* context_ = nullptr;
  std::array<std::uint8_t, 4> pixel_{};  ///< the default framebuffer, which must be there
  std::mutex mutex_;
};

/// The OpenGL objects of one owner, which end() deletes together while their context is current.
class Objects {
 public:
  GLuint texture() { return add(glGenTextures, glDeleteTextures); }
  GLuint sampler() { return add(glGenSamplers, glDeleteSamplers); }
  GLuint framebuffer() { return add(glGenFramebuffers, glDeleteFramebuffers); }
  GLuint renderbuffer() { return add(glGenRenderbuffers, glDeleteRenderbuffers); }
  GLuint buffer() { return add(glGenBuffers, glDeleteBuffers); }
  GLuint vertex_array() { return add(glGenVertexArrays, glDeleteVertexArrays); }

  void end() const {
    for (const auto& [remove, name] : names_) remove(1, &name);
  }

 private:
  using Delete = void (*)(GLsizei, const GLuint*);

  GLuint add(void (*generate)(GLsizei, GLuint*), Delete remove) {
    GLuint name = 0;
    generate(1, &name);
    names_.emplace_back(remove, name);
    return name;
  }

  std::vector<std::pair<Delete, GLuint>> names_;
};

/// The texture units that the samplers of gl.cpp read.
enum Unit : GLint {
  shadow_depth_unit,
  shadow_test_unit,
  shadow_nearest_unit,
  occlusion_unit,
  depth_unit,
  surface_unit,
  emission_unit,
  crevice_unit,
  nearer_unit,
  surface_texture_unit,  ///< the first of five, by Surface::Role
};

/// Bindings of uniform blocks: the frame, the bodies' poses in clip space, and those in the world.
enum Block : GLuint { frame_block, clip_poses_block, world_poses_block };

/// Compiles and links shaders, given without their version line, and uses the program. Throws
/// std::logic_error with the compiler's message: our own shaders are at fault then.
GLuint make_program(const std::string& vertex, const std::string& fragment);

void bind_texture(GLint unit, GLuint texture);

}  // namespace substep::render
