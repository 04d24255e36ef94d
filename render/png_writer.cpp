#include <libdeflate.h>

#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <shared_mutex>
#include <string>
#include <utility>

#include "render/image.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

/// How hard libdeflate tries, 1 to 12, in this thread's next file.
thread_local int deflate_level = 3;

/// Compresses for stb_image_write, which frees the result.
unsigned char* deflated(const unsigned char* bytes, int size, int* result_size, int /*quality*/) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(deflate_level), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  const auto count = static_cast<std::size_t>(size);
  const std::size_t bound = libdeflate_zlib_compress_bound(compressor.get(), count);
  auto* const result = static_cast<unsigned char*>(std::malloc(bound));
  if (result == nullptr) throw std::bad_alloc();
  *result_size = static_cast<int>(libdeflate_zlib_compress(compressor.get(), bytes, count, result, bound));
  return result;
}

}  // namespace
}  // namespace substep::render

#define STBIW_ZLIB_COMPRESS substep::render::deflated
// The analyser finds fault with the implementation, which is not ours to mend.
#ifndef __clang_analyzer__
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#endif
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

namespace substep::render {
namespace {

/// The filter that stb is told to use is one of all threads.
std::shared_mutex filter_in_use;

std::string png_of(const std::uint8_t* pixels, int width, int height, int channels, int level) {
  if (width <= 0 || height <= 0) throw Error("an image without pixels cannot be written as PNG");
  deflate_level = level;
  std::string file;
  const auto append = [](void* to, void* bytes, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
  };
  if (stbi_write_png_to_func(append, &file, width, height, channels, pixels, 0) == 0) throw std::bad_alloc();
  return file;
}

}  // namespace

std::string to_png(const Image& image) {
  const std::shared_lock lock(filter_in_use);
  return png_of(image.rgb.data(), image.width, image.height, 3, 3);
}

std::string to_small_png(const Image& image) {
  // Try stb's choice of a filter for each row, and each filter for all rows.
  constexpr int filters = 5;
  const std::unique_lock lock(filter_in_use);
  std::string smallest;
  for (int filter = -1; filter < filters; ++filter) {
    stbi_write_force_png_filter = filter;
    std::string file = png_of(image.rgb.data(), image.width, image.height, 3, 12);
    if (smallest.empty() || file.size() < smallest.size()) smallest = std::move(file);
  }
  stbi_write_force_png_filter = -1;
  return smallest;
}

std::string to_png(const Texels& texels) {
  const std::shared_lock lock(filter_in_use);
  bool is_opaque = true;
  for (std::size_t i = 3; i < texels.rgba.size(); i += 4) is_opaque = is_opaque && texels.rgba[i] == 255;
  if (!is_opaque) return png_of(texels.rgba.data(), texels.width, texels.height, 4, 9);
  Image image(texels.width, texels.height);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = texels.rgba[i / 3 * 4 + i % 3];
  return png_of(image.rgb.data(), image.width, image.height, 3, 9);
}

void write_png(const Image& image, const std::filesystem::path& file) {
  write_file(file, to_png(image));
}

}  // namespace substep::render
