#include "render/textures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "render/image.h"
#include "render/resolve.h"
#include "sim/error.h"

namespace substep::render {
namespace {

/// A mip level of an image: four numbers a texel, in 65535ths, rows from the top. Colours are
/// decoded to linear light, which is then averaged; other images keep their numbers.
struct TextureLevel {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> numbers;
};

bool is_light(std::size_t i, bool is_color) {
  return is_color && i % 4 != 3;
}

TextureLevel first_level(const Texels& texels, bool is_color) {
  TextureLevel level{texels.width, texels.height, std::vector<std::uint16_t>(texels.rgba.size())};
  for (std::size_t i = 0; i < texels.rgba.size(); ++i) {
    level.numbers[i] = is_light(i, is_color) ? linear_light(texels.rgba[i])
                                             : static_cast<std::uint16_t>(texels.rgba[i] * 257);
  }
  return level;
}

/// Returns the inverse of first_level(), to the nearest code.
Texels texels_of(const TextureLevel& level, bool is_color) {
  Texels texels{level.width, level.height, std::vector<std::uint8_t>(level.numbers.size())};
  for (std::size_t i = 0; i < level.numbers.size(); ++i) {
    texels.rgba[i] = is_light(i, is_color) ? nearest_code(level.numbers[i])
                                           : static_cast<std::uint8_t>((level.numbers[i] + 128) / 257);
  }
  return texels;
}

/// Returns the level half as wide and high, each texel the mean of the four it covers, in integers: the
/// driver's mip levels may differ from machine to machine.
TextureLevel halved(const TextureLevel& level) {
  TextureLevel half{std::max(1, level.width / 2), std::max(1, level.height / 2), {}};
  half.numbers.reserve(std::size_t{4} * half.width * half.height);
  const auto at = [&](int x, int y, int c) {
    const int column = std::min(x, level.width - 1);
    return int{
        level.numbers[4 * (std::size_t{1} * std::min(y, level.height - 1) * level.width + column) + c]};
  };
  for (int y = 0; y < 2 * half.height; y += 2) {
    for (int x = 0; x < 2 * half.width; x += 2) {
      for (int c = 0; c < 4; ++c) {
        const int sum = at(x, y, c) + at(x + 1, y, c) + at(x, y + 1, c) + at(x + 1, y + 1, c);
        half.numbers.push_back(static_cast<std::uint16_t>((sum + 2) / 4));
      }
    }
  }
  return half;
}

GLuint upload(Objects& objects, TextureLevel level) {
  const GLuint name = objects.texture();
  glBindTexture(GL_TEXTURE_2D, name);
  for (int index = 0;; ++index) {
    glTexImage2D(GL_TEXTURE_2D, index, GL_RGBA16, level.width, level.height, 0, GL_RGBA, GL_UNSIGNED_SHORT,
                 level.numbers.data());
    if (level.width == 1 && level.height == 1) return name;
    level = halved(level);
  }
}

/// Uploads an image, or without one a white texel, which as a normal of strength 0 is straight up. Adds the
/// image's pixels to `total`.
BoundTexture uploaded(Objects& objects, const Scene& scene, int image, bool is_color, double& total) {
  if (image < 0) return {.texture = upload(objects, first_level({1, 1, {255, 255, 255, 255}}, is_color))};
  const SceneImage& source = scene.images[image];
  const Texels pixels = decode_texels(*source.bytes, source.place);
  // A texel takes 8 bytes, and a third more for its mip levels.
  constexpr double most_texels = 64e6;
  total += static_cast<double>(pixels.width) * pixels.height;
  if (total > most_texels) {
    throw Error(
        "{}: with it the images on surfaces have more than {:.0f} million pixels in all: "
        "make them smaller",
        source.place, most_texels / 1e6);
  }
  return {.texture = upload(objects, first_level(pixels, is_color)),
          .texels = std::sqrt(static_cast<float>(pixels.width) * static_cast<float>(pixels.height))};
}

GLuint new_sampler(Objects& objects, const std::array<GLint, 4>& sampling) {
  constexpr std::array<GLenum, 4> names{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_MAG_FILTER,
                                        GL_TEXTURE_MIN_FILTER};
  const GLuint sampler = objects.sampler();
  for (std::size_t i = 0; i < names.size(); ++i) glSamplerParameteri(sampler, names[i], sampling[i]);
  return sampler;
}

bool is_color(std::size_t role) {
  return role == Surface::color_texture || role == Surface::emission_texture;
}

/// Returns whether browsers may rotate an image by its Exif data; glTF and the renderer ignore the data.
bool may_be_turned(std::string_view file) {
  return file.find("Exif") != std::string_view::npos || file.find("eXIf") != std::string_view::npos;
}

/// An image at its present size, and its file.
struct ShrinkingImage {
  TextureLevel level;
  bool is_color;
  std::shared_ptr<const std::string> file;

  /// Halves the image until no side exceeds `longest`.
  void shrink_to(int longest) {
    const auto is_longer = [&] { return std::max(level.width, level.height) > longest; };
    if (!is_longer()) return;
    while (is_longer()) level = halved(level);
    encode();
  }

  void encode() { file = std::make_shared<const std::string>(to_png(texels_of(level, is_color))); }
};

}  // namespace

std::array<GLint, 4> sampling_of(const Texture& texture) {
  constexpr std::array<GLint, 3> wraps{GL_REPEAT, GL_MIRRORED_REPEAT, GL_CLAMP_TO_EDGE};
  constexpr std::array<std::array<GLint, 2>, 3> far_filters{
      {{GL_LINEAR, GL_NEAREST},
       {GL_LINEAR_MIPMAP_NEAREST, GL_NEAREST_MIPMAP_NEAREST},
       {GL_LINEAR_MIPMAP_LINEAR, GL_NEAREST_MIPMAP_LINEAR}}};
  return {wraps[static_cast<int>(texture.wrap[0])], wraps[static_cast<int>(texture.wrap[1])],
          texture.is_sharp_near ? GL_NEAREST : GL_LINEAR,
          far_filters[static_cast<int>(texture.levels)][texture.is_sharp_far ? 1 : 0]};
}

std::vector<SurfaceTextures> upload_textures(Objects& objects, const Scene& scene,
                                             const std::vector<Surface>& surfaces) {
  std::map<std::pair<int, bool>, BoundTexture> images;  // by index and whether it is colour
  std::map<std::array<GLint, 4>, GLuint> samplers;
  double texels = 0;
  std::vector<SurfaceTextures> result;
  for (const Surface& surface : surfaces) {
    SurfaceTextures& textures = result.emplace_back();
    for (std::size_t role = 0; role < textures.size(); ++role) {
      const Texture& texture = surface.textures[role];
      const auto [image, is_new_image] = images.try_emplace({texture.image, is_color(role)});
      if (is_new_image) image->second = uploaded(objects, scene, texture.image, is_color(role), texels);
      const auto [sampler, is_new_sampler] = samplers.try_emplace(sampling_of(texture));
      if (is_new_sampler) sampler->second = new_sampler(objects, sampler->first);
      textures[role] = image->second;
      textures[role].sampler = sampler->second;
    }
  }
  return result;
}

Scene with_smaller_images(const Scene& scene, std::span<const Surface> surfaces, const ImageLimits& limits) {
  // An image that is also used as colour is averaged as colour.
  std::map<int, bool> images;
  for (const Surface& surface : surfaces) {
    for (std::size_t role = 0; role < surface.textures.size(); ++role) {
      const int image = surface.textures[role].image;
      if (image >= 0) images[image] |= is_color(role);
    }
  }
  std::map<int, ShrinkingImage> shrinking;
  for (const auto& [index, as_color] : images) {
    const SceneImage& source = scene.images[index];
    ShrinkingImage image{first_level(decode_texels(*source.bytes, source.place), as_color), as_color,
                         source.bytes};
    image.shrink_to(limits.longest);
    if (image.file == source.bytes && may_be_turned(*image.file)) image.encode();
    shrinking.emplace(index, std::move(image));
  }
  constexpr int shortest = 16;  // pixels; shorter images show nothing, and hardly take fewer bytes
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const auto& [index, image] : shrinking) sum += image.file->size();
    return sum;
  };
  for (int side = limits.longest / 2; side >= shortest && bytes() > limits.bytes; side /= 2) {
    for (auto& [index, image] : shrinking) image.shrink_to(side);
  }
  Scene smaller = scene;
  for (const auto& [index, image] : shrinking) smaller.images[index].bytes = image.file;
  return smaller;
}

}  // namespace substep::render
