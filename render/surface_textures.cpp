#include "render/surface_textures.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "render/image.h"
#include "render/texture_level.h"
#include "sim/error.h"

namespace substep::render {
namespace {

GLuint upload(TextureLevel level) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D, name);
  for (int index = 0;; ++index) {
    glTexImage2D(GL_TEXTURE_2D, index, GL_RGBA16, level.width, level.height, 0, GL_RGBA, GL_UNSIGNED_SHORT,
                 level.numbers.data());
    if (level.width == 1 && level.height == 1) break;
    level = halved(level);
  }
  return name;
}

GLint wrap_name(Texture::Wrap wrap) {
  switch (wrap) {
    case Texture::Wrap::repeat:
      return GL_REPEAT;
    case Texture::Wrap::mirrored:
      return GL_MIRRORED_REPEAT;
    case Texture::Wrap::clamped:
      return GL_CLAMP_TO_EDGE;
  }
  return GL_REPEAT;
}

GLint far_filter(const Texture& texture) {
  switch (texture.levels) {
    case Texture::Levels::none:
      return texture.is_sharp_far ? GL_NEAREST : GL_LINEAR;
    case Texture::Levels::nearest:
      return texture.is_sharp_far ? GL_NEAREST_MIPMAP_NEAREST : GL_LINEAR_MIPMAP_NEAREST;
    case Texture::Levels::blended:
      return texture.is_sharp_far ? GL_NEAREST_MIPMAP_LINEAR : GL_LINEAR_MIPMAP_LINEAR;
  }
  return GL_LINEAR_MIPMAP_LINEAR;
}

}  // namespace

SurfaceTextures::SurfaceTextures(const Scene& scene, const std::vector<Surface>& surfaces) {
  // White, and straight up as a normal.
  for (const bool is_color : {true, false}) {
    Texels one{1, 1, {255, 255, 255, 255}};
    textures_[{-1, is_color}] = {upload(first_level(one, is_color)), 1.0F};
  }
  for (const Surface& surface : surfaces) {
    std::array<BoundTexture, 5>& all = bound_.emplace_back();
    for (std::size_t role = 0; role < all.size(); ++role) {
      const Texture& texture = surface.textures[role];
      const bool is_color = role == Surface::color_texture || role == Surface::emission_texture;
      all[role].texture = uploaded(scene, texture.image, is_color);
      all[role].sampler = sampler(texture);
      all[role].texels = textures_.at({texture.image, is_color}).second;
    }
  }
}

GLuint SurfaceTextures::uploaded(const Scene& scene, int image, bool is_color) {
  const std::pair key(image, is_color);
  if (const auto found = textures_.find(key); found != textures_.end()) return found->second.first;
  const SceneImage& source = scene.images[static_cast<std::size_t>(image)];
  const Texels texels = decode_texels(*source.bytes, source.place);
  // At 8 bytes each, and a third more for the smaller copies.
  constexpr double most = 64e6;
  texels_ += static_cast<double>(texels.width) * texels.height;
  if (texels_ > most) {
    throw Error(
        fmt::format("{}: with it the images on surfaces have more than {:.0f} million pixels in all: "
                    "make them smaller",
                    source.place, most / 1e6));
  }
  const float wide = std::sqrt(static_cast<float>(texels.width) * static_cast<float>(texels.height));
  return textures_.emplace(key, std::pair(upload(first_level(texels, is_color)), wide)).first->second.first;
}

GLuint SurfaceTextures::sampler(const Texture& texture) {
  const std::array<int, 5> key{static_cast<int>(texture.wrap[0]), static_cast<int>(texture.wrap[1]),
                               texture.is_sharp_near ? 1 : 0, texture.is_sharp_far ? 1 : 0,
                               static_cast<int>(texture.levels)};
  const auto [place, is_new] = samplers_.try_emplace(key);
  if (!is_new) return place->second;
  GLuint& name = place->second;
  glGenSamplers(1, &name);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_S, wrap_name(texture.wrap[0]));
  glSamplerParameteri(name, GL_TEXTURE_WRAP_T, wrap_name(texture.wrap[1]));
  glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, texture.is_sharp_near ? GL_NEAREST : GL_LINEAR);
  glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, far_filter(texture));
  return name;
}

void SurfaceTextures::end() const {
  for (const auto& [key, texture] : textures_) glDeleteTextures(1, &texture.first);
  for (const auto& [key, name] : samplers_) glDeleteSamplers(1, &name);
}

}  // namespace substep::render
