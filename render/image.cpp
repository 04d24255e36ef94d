#include "render/image.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <shared_mutex>
#include <utility>

#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/math/fnv1a.h"

namespace substep::render {
namespace {

/// The compression level, 1 to 12, of this thread's next file.
thread_local int deflate_level = 3;

/// Compresses for stb_image_write, which frees the result.
unsigned char* deflated(const unsigned char* bytes, int size, int* result_size, int /*quality*/) {
  const std::string result =
      zlib_compressed({reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size)}, deflate_level);
  auto* const copy = static_cast<unsigned char*>(std::malloc(result.size()));
  if (copy == nullptr) throw std::bad_alloc();
  *result_size = static_cast<int>(result.copy(reinterpret_cast<char*>(copy), result.size()));
  return copy;
}

}  // namespace
}  // namespace substep::render

// The analyser finds fault with the implementations, which are not ours to mend.
#ifndef __clang_analyzer__
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#endif
#define STBI_NO_STDIO
#define STBI_WRITE_NO_STDIO
#define STBIW_ZLIB_COMPRESS substep::render::deflated
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

namespace substep::render {
namespace {

/// Guards stbi_write_force_png_filter, a global variable that to_small_png() changes.
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

/// Returns the pixels with `channels` bytes each; empty where the file cannot be decoded.
std::vector<std::uint8_t> decoded(std::string_view file, int channels, int& width, int& height) {
  int channels_in_file = 0;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(file.data()), static_cast<int>(file.size()),
                            &width, &height, &channels_in_file, channels),
      &stbi_image_free);
  if (!pixels) return {};
  return {pixels.get(), pixels.get() + std::size_t{1} * width * height * channels};
}

/// Returns the IDAT data of a PNG of 8-bit RGB that is not interlaced: PDF reads such rows, too.
std::string compressed_rows(const std::string& png) {
  const auto big_endian = [&png](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png.at(at + i));
    return value;
  };
  std::string rows;
  constexpr std::size_t signature = 8;
  constexpr std::size_t overhead = 12;  // length, kind and checksum of a chunk
  for (std::size_t at = signature; at + overhead <= png.size(); at += overhead + big_endian(at))
    if (png.compare(at + 4, 4, "IDAT") == 0) rows += png.substr(at + 8, big_endian(at));
  return rows;
}

}  // namespace

std::uint64_t hash(const Image& image) {
  std::uint64_t value = fnv1a_start;
  for (const int size : {image.width, image.height})
    value = fnv1a_of_number(static_cast<std::uint32_t>(size), 4, value);
  return fnv1a({reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size()}, value);
}

std::string zlib_compressed(std::string_view bytes, int level) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(level), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string result(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  result.resize(
      libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), result.data(), result.size()));
  return result;
}

Image from_png(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with("\x89PNG")) throw Error(name + ": is not a complete PNG image (no PNG signature)");
  Image image;
  image.rgb = decoded(bytes, 3, image.width, image.height);
  if (image.rgb.empty()) throw Error("{}: is not a complete PNG image ({})", name, stbi_failure_reason());
  return image;
}

Texels decode_texels(std::string_view bytes, const std::string& name) {
  Texels texels;
  int channels = 0;
  // Check the size first: a picture of few bytes may need much memory.
  const int is_known =
      stbi_info_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()), static_cast<int>(bytes.size()),
                            &texels.width, &texels.height, &channels);
  if (is_known != 0 && std::max(texels.width, texels.height) > longest_texture)
    throw Error("{}: has {}×{} pixels; images on surfaces have at most {} each way: make it smaller", name,
                texels.width, texels.height, longest_texture);
  if (is_known != 0) texels.rgba = decoded(bytes, 4, texels.width, texels.height);
  if (texels.rgba.empty())
    throw Error("{}: is not a complete PNG or JPEG image ({})", name, stbi_failure_reason());
  return texels;
}

Image read_png(const std::filesystem::path& file) {
  const auto bytes = content_of(file);
  if (!bytes) throw Error(file.string() + ": cannot be opened");
  return from_png(*bytes, file.string());
}

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

std::string to_pdf(const Image& image, double width) {
  const double points = width / 25.4 * 72;
  const double height = points * image.height / image.width;
  const std::string rows = compressed_rows(to_png(image));
  const std::string drawing = fmt::format("q {:.4f} 0 0 {:.4f} 0 0 cm /I Do Q", points, height);
  const std::vector<std::string> objects{
      "<</Type/Catalog/Pages 2 0 R>>", "<</Type/Pages/Kids[3 0 R]/Count 1>>",
      fmt::format("<</Type/Page/Parent 2 0 R/MediaBox[0 0 {:.4f} {:.4f}]/Contents 4 0 R"
                  "/Resources<</XObject<</I 5 0 R>>>>>>",
                  points, height),
      fmt::format("<</Length {}>>\nstream\n{}\nendstream", drawing.size(), drawing),
      fmt::format("<</Type/XObject/Subtype/Image/Width {0}/Height {1}/ColorSpace/DeviceRGB/BitsPerComponent 8"
                  "/Filter/FlateDecode/DecodeParms<</Predictor 15/Colors 3/Columns {0}>>/Length {2}>>\n"
                  "stream\n{3}\nendstream",
                  image.width, image.height, rows.size(), rows)};
  std::string file = "%PDF-1.4\n%\xe2\xe3\xcf\xd3\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  return fmt::format("{}{}trailer\n<</Size {}/Root 1 0 R>>\nstartxref\n{}\n%%EOF\n", file, table,
                     objects.size() + 1, file.size());
}

}  // namespace substep::render
