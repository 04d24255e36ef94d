#include "render/image.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <string_view>

#include "sim/error.h"
#include "sim/math/fnv1a.h"

// The analyser finds fault with the implementation, which is not ours to mend.
#ifndef __clang_analyzer__
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#endif
#define STBI_NO_STDIO
#include <stb/stb_image.h>

namespace substep::render {
std::uint64_t hash(const Image& image) {
  std::uint64_t value = fnv1a_start;
  for (const int size : {image.width, image.height}) {
    value = fnv1a_of_number(static_cast<std::uint32_t>(size), 4, value);
  }
  return fnv1a({reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()}, value);
}

Image from_png(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with("\x89PNG")) throw Error(name + ": not a whole PNG image (it begins otherwise)");
  int width = 0;
  int height = 0;
  int channels = 0;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()), static_cast<int>(bytes.size()),
                            &width, &height, &channels, 3),
      &stbi_image_free);
  if (!pixels) throw Error(name + ": not a whole PNG image (" + stbi_failure_reason() + ")");
  Image image(width, height);
  image.rgb.assign(pixels.get(), pixels.get() + image.rgb.size());
  return image;
}

Texels decode_texels(std::string_view bytes, const std::string& name) {
  const auto* const begin = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  Texels texels;
  int channels = 0;
  // Its size first: a picture of few bytes may ask for much memory.
  if (stbi_info_from_memory(begin, size, &texels.width, &texels.height, &channels) == 0) {
    throw Error(fmt::format("{}: is no whole PNG or JPEG image ({})", name, stbi_failure_reason()));
  }
  if (texels.width > longest_texture || texels.height > longest_texture) {
    throw Error(
        fmt::format("{}: has {}×{} pixels; images on surfaces have at most {} each way: make it smaller",
                    name, texels.width, texels.height, longest_texture));
  }
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(begin, size, &texels.width, &texels.height, &channels, 4), &stbi_image_free);
  if (!pixels) {
    throw Error(fmt::format("{}: is no whole PNG or JPEG image ({})", name, stbi_failure_reason()));
  }
  texels.rgba.assign(pixels.get(), pixels.get() + std::size_t{4} * texels.width * texels.height);
  return texels;
}

Image read_png(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) throw Error(file.string() + ": cannot be opened");
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  return from_png(bytes, file.string());
}

}  // namespace substep::render
