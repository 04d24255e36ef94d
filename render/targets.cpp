#include "render/targets.h"

#include <string>

#include "sim/error.h"

namespace substep {
namespace {

[[noreturn]] void refuse_size(int width, int height) {
  throw Error("software OpenGL cannot draw " + std::to_string(width) + " × " + std::to_string(height) +
              " samples: ask for a smaller picture");
}

}  // namespace

Target::Target(int w, int h) : width(w), height(h), pixels(static_cast<std::size_t>(w) * h * 4) {
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glGenRenderbuffers(1, &color);
  glBindRenderbuffer(GL_RENDERBUFFER, color);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
  glGenRenderbuffers(1, &depth);
  glBindRenderbuffer(GL_RENDERBUFFER, depth);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH32F_STENCIL8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) refuse_size(width, height);
}

void Target::start() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

void Target::end() const {
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteRenderbuffers(1, &color);
  glDeleteRenderbuffers(1, &depth);
}

namespace {

constexpr std::array<GLenum, 4> outputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2,
                                        GL_COLOR_ATTACHMENT3};

/// Attaches those that there are.
void attach(const std::array<GLuint, 4>& textures) {
  GLsizei count = 0;
  for (; count < 4 && textures[static_cast<std::size_t>(count)] != 0; ++count) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, outputs[static_cast<std::size_t>(count)], GL_TEXTURE_2D,
                           textures[static_cast<std::size_t>(count)], 0);
  }
  glDrawBuffers(count, outputs.data());
}

void require_complete(const Target& target) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    refuse_size(target.width, target.height);
}

}  // namespace

Surfaces::Surfaces(const Target& target, bool with_emission) {
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glGenTextures(with_emission ? 4 : 3, textures.data());
  for (const GLuint texture : textures) {
    if (texture == 0) continue;
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, target.width, target.height, 0, GL_RGBA, GL_FLOAT, nullptr);
  }
  attach(textures);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, target.depth);
  require_complete(target);
}

void Surfaces::end() const {
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteTextures(4, textures.data());
}

Layers::Layers(const Target& target, const Surfaces& shared) {
  glGenTextures(2, depths.data());
  glGenFramebuffers(2, surfaces.data());
  glGenFramebuffers(2, lit.data());
  for (std::size_t i = 0; i < depths.size(); ++i) {
    glBindTexture(GL_TEXTURE_2D, depths[i]);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH32F_STENCIL8, target.width, target.height, 0, GL_DEPTH_STENCIL,
                 GL_FLOAT_32_UNSIGNED_INT_24_8_REV, nullptr);
    glBindFramebuffer(GL_FRAMEBUFFER, surfaces[i]);
    attach(shared.textures);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_TEXTURE_2D, depths[i], 0);
    require_complete(target);
    glBindFramebuffer(GL_FRAMEBUFFER, lit[i]);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, target.color);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_TEXTURE_2D, depths[i], 0);
    require_complete(target);
  }
}

void Layers::end() const {
  glDeleteFramebuffers(2, surfaces.data());
  glDeleteFramebuffers(2, lit.data());
  glDeleteTextures(2, depths.data());
}

}  // namespace substep
