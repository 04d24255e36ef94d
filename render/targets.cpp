#include "render/targets.h"

#include <algorithm>

#include "sim/error.h"

namespace substep::render {
namespace {

constexpr std::array<GLenum, 3> outputs{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};

/// Gives the current framebuffer a buffer to draw to, and returns it.
GLuint attach_buffer(Objects& objects, GLenum attachment, GLenum format, int width, int height) {
  const GLuint buffer = objects.renderbuffer();
  glBindRenderbuffer(GL_RENDERBUFFER, buffer);
  glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
  return buffer;
}

/// Throws Error where the current framebuffer cannot be drawn to.
void require_complete(int width, int height) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return;
  throw Error("software OpenGL cannot draw {} × {} samples: ask for a smaller picture", width, height);
}

}  // namespace

GLuint bound_framebuffer(Objects& objects) {
  const GLuint framebuffer = objects.framebuffer();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  return framebuffer;
}

GLuint attach_textures(Objects& objects, const std::array<GLuint, 3>& textures, int width, int height) {
  GLsizei count = 0;
  for (; count < 3 && textures[count] != 0; ++count) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, outputs[count], GL_TEXTURE_2D, textures[count], 0);
  }
  glDrawBuffers(count, outputs.data());
  const GLuint depth = objects.texture();
  glBindTexture(GL_TEXTURE_2D, depth);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width, height, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  return depth;
}

Target::Target(Objects& objects, int w, int h)
    : framebuffer(bound_framebuffer(objects)), width(w), height(h), pixels(std::size_t{4} * w * h) {
  attach_buffer(objects, GL_COLOR_ATTACHMENT0, GL_RGBA8, width, height);
  depth = attach_buffer(objects, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, width, height);
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

Surfaces::Surfaces(Objects& objects, int w, int h, bool with_emission)
    : framebuffer(bound_framebuffer(objects)), width(w), height(h) {
  constexpr std::array<GLint, 3> formats{GL_RGBA32I, GL_RGBA32F, GL_R32F};
  for (std::size_t i = 0; i < (with_emission ? 3 : 1); ++i) {
    textures[i] = objects.texture();
    glBindTexture(GL_TEXTURE_2D, textures[i]);
    glTexImage2D(GL_TEXTURE_2D, 0, formats[i], width, height, 0, i == 0 ? GL_RGBA_INTEGER : GL_RGBA,
                 i == 0 ? GL_INT : GL_FLOAT, nullptr);
  }
  depth = attach_textures(objects, textures, width, height);
  require_complete(width, height);
}

Surfaces::Surfaces(Objects& objects, const Surfaces& shared)
    : framebuffer(bound_framebuffer(objects)),
      textures(shared.textures),
      depth(attach_textures(objects, textures, shared.width, shared.height)),
      width(shared.width),
      height(shared.height) {
  require_complete(width, height);
}

void Surfaces::clear() {
  constexpr std::array<GLint, 4> none{};
  glClearBufferiv(GL_COLOR, 0, none.data());
}

void Surfaces::start() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  glClear(GL_DEPTH_BUFFER_BIT);
}

void Surfaces::copy(const Surfaces& from, std::span<const Rectangle> areas, int samples,
                    GLbitfield buffers) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  for (const Rectangle& area : areas) {
    const int left = samples * area.x;
    const int low = samples * area.y;
    const int right = std::min(left + samples * area.width, width);
    const int high = std::min(low + samples * area.height, height);
    glBlitFramebuffer(left, low, right, high, left, low, right, high, buffers, GL_NEAREST);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
}

LightingBuffer::LightingBuffer(Objects& objects, const Target& picture, bool with_opacities)
    : framebuffer(bound_framebuffer(objects)) {
  const GLsizei count = with_opacities ? 3 : 2;
  for (GLsizei i = 0; i < count; ++i) {
    attach_buffer(objects, outputs[i], GL_RGBA8, picture.width, picture.height);
    pixels[i].resize(picture.pixels.size());
  }
  glDrawBuffers(count, outputs.data());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, picture.depth);
  require_complete(picture.width, picture.height);
}

void LightingBuffer::read(const Target& picture) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].empty()) continue;
    glReadBuffer(outputs[i]);
    glReadPixels(0, 0, picture.width, picture.height, GL_RGBA, GL_UNSIGNED_BYTE, pixels[i].data());
  }
}

}  // namespace substep::render
