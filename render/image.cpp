#include "render/image.h"

#include <libdeflate.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <string_view>

#include "sim/error.h"
#include "sim/log/file_output.h"

// The analyser finds fault with the implementation, which is not ours to mend.
#ifndef __clang_analyzer__
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#endif
#define STBI_NO_STDIO
#include <stb/stb_image.h>

namespace substep {
namespace {

void append_number(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift & 0xff));
}

void append_chunk(std::string& file, std::string_view kind, std::string_view content) {
  append_number(file, static_cast<std::uint32_t>(content.size()));
  const std::size_t checked = file.size();
  file.append(kind).append(content);
  append_number(file, libdeflate_crc32(0, file.data() + checked, file.size() - checked));
}

}  // namespace

std::uint64_t hash(const Image& image) {
  std::uint64_t value = 0xcbf29ce484222325u;
  const auto add = [&value](std::uint8_t byte) { value = (value ^ byte) * 0x100000001b3u; };
  for (const int size : {image.width, image.height}) {
    for (int shift = 0; shift < 32; shift += 8) add(static_cast<std::uint8_t>(size >> shift));
  }
  for (const std::uint8_t byte : image.rgb) add(byte);
  return value;
}

std::string to_png(const Image& image) {
  if (image.width <= 0 || image.height <= 0) throw Error("an image without pixels cannot be written as PNG");
  // Each row's bytes as differences from the pixel to the left: filter 1. With libdeflate's level 3 this gave
  // the smallest files of all that take little time.
  const std::size_t row_bytes = static_cast<std::size_t>(image.width) * 3;
  std::string rows;
  rows.reserve((row_bytes + 1) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.pixel(0, y);
    rows.push_back(1);
    for (std::size_t i = 0; i < row_bytes; ++i) {
      rows.push_back(static_cast<char>(row[i] - (i < 3 ? 0 : row[i - 3])));
    }
  }
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(3), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string compressed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()), '\0');
  compressed.resize(libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), compressed.data(),
                                             compressed.size()));

  std::string file = "\x89PNG\r\n\x1a\n";
  std::string header;
  append_number(header, static_cast<std::uint32_t>(image.width));
  append_number(header, static_cast<std::uint32_t>(image.height));
  header.append({8, 2, 0, 0, 0});  // 8 bits of red, green and blue, not interlaced
  append_chunk(file, "IHDR", header);
  append_chunk(file, "IDAT", compressed);
  append_chunk(file, "IEND", "");
  return file;
}

void write_png(const Image& image, const std::filesystem::path& file) {
  write_file(file, to_png(image));
}

Image read_png(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) throw Error(file.string() + ": cannot be opened");
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  int width = 0;
  int height = 0;
  int channels = 0;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()), static_cast<int>(bytes.size()),
                            &width, &height, &channels, 3),
      &stbi_image_free);
  if (!pixels) throw Error(file.string() + ": not a whole PNG image (" + stbi_failure_reason() + ")");
  Image image(width, height);
  image.rgb.assign(pixels.get(), pixels.get() + image.rgb.size());
  return image;
}

}  // namespace substep
