#include "render/targets.h"

#include <algorithm>
#include <string>

#include "sim/error.h"

namespace substep::render {
namespace {

[[noreturn]] void refuse_size(int width, int height) {
  throw Error("software OpenGL cannot draw " + std::to_string(width) + " × " + std::to_string(height) +
              " samples: ask for a smaller picture");
}

void require_complete(int width, int height) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) refuse_size(width, height);
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
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
  require_complete(width, height);
}

void Target::start() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
}

void Target::start_anew() const {
  start();
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void Target::end() const {
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteRenderbuffers(1, &color);
  glDeleteRenderbuffers(1, &depth);
}

namespace {

constexpr std::array<GLenum, 3> outputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};

/// Attaches those that there are, and the depth.
void attach(const std::array<GLuint, 3>& textures, GLuint depth) {
  GLsizei count = 0;
  for (; count < 3 && textures[static_cast<std::size_t>(count)] != 0; ++count) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, outputs[static_cast<std::size_t>(count)], GL_TEXTURE_2D,
                           textures[static_cast<std::size_t>(count)], 0);
  }
  glDrawBuffers(count, outputs.data());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
}

void make_depth(GLuint texture, int width, int height) {
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width, height, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
}

}  // namespace

Surfaces::Surfaces(int w, int h, bool with_emission) : width(w), height(h) {
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glGenTextures(with_emission ? 3 : 1, textures.data());
  glBindTexture(GL_TEXTURE_2D, textures[0]);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32I, width, height, 0, GL_RGBA_INTEGER, GL_INT, nullptr);
  for (std::size_t i = 1; i < textures.size() && textures[i] != 0; ++i) {
    glBindTexture(GL_TEXTURE_2D, textures[i]);
    glTexImage2D(GL_TEXTURE_2D, 0, i == 1 ? GL_RGBA32F : GL_R32F, width, height, 0, GL_RGBA, GL_FLOAT,
                 nullptr);
  }
  glGenTextures(1, &depth);
  make_depth(depth, width, height);
  attach(textures, depth);
  require_complete(width, height);
}

void Surfaces::clear() const {
  constexpr std::array<GLint, 4> none{};
  glClearBufferiv(GL_COLOR, 0, none.data());
}

void Surfaces::start() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void Surfaces::copy(const Surfaces& from, std::span<const Rectangle> areas, int samples) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  for (const Rectangle& area : areas) {
    const int left = samples * area.x;
    const int low = samples * area.y;
    const int right = std::min(left + samples * area.width, width);
    const int high = std::min(low + samples * area.height, height);
    glBlitFramebuffer(left, low, right, high, left, low, right, high,
                      GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
}

void Surfaces::end() const {
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteTextures(3, textures.data());
  glDeleteTextures(1, &depth);
}

Lit::Lit(const Target& picture, bool with_opacities) {
  const GLsizei count = with_opacities ? 3 : 2;
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glGenRenderbuffers(count, colors.data());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    glBindRenderbuffer(GL_RENDERBUFFER, colors[i]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, picture.width, picture.height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, outputs[i], GL_RENDERBUFFER, colors[i]);
    pixels[i].resize(picture.pixels.size());
  }
  glDrawBuffers(count, outputs.data());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, picture.depth);
  require_complete(picture.width, picture.height);
}

void Lit::read(const Target& picture) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].empty()) continue;
    glReadBuffer(outputs[i]);
    glReadPixels(0, 0, picture.width, picture.height, GL_RGBA, GL_UNSIGNED_BYTE, pixels[i].data());
  }
}

void Lit::end() const {
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteRenderbuffers(3, colors.data());
}

Layers::Layers(const Surfaces& shared) {
  glGenTextures(2, depths.data());
  glGenFramebuffers(2, surfaces.data());
  for (std::size_t i = 0; i < depths.size(); ++i) {
    make_depth(depths[i], shared.width, shared.height);
    glBindFramebuffer(GL_FRAMEBUFFER, surfaces[i]);
    attach(shared.textures, depths[i]);
    require_complete(shared.width, shared.height);
  }
}

void Layers::end() const {
  glDeleteFramebuffers(2, surfaces.data());
  glDeleteTextures(2, depths.data());
}

}  // namespace substep::render
