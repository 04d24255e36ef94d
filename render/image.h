#pragma once
/// An 8-bit sRGB image and its files.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace substep::render {

struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, sRGB-encoded, rows from the top

  Image() = default;
  Image(int w, int h) : width(w), height(h), rgb(static_cast<std::size_t>(w) * h * 3) {}
  std::uint8_t* pixel(int x, int y) { return &rgb[(static_cast<std::size_t>(y) * width + x) * 3]; }
  const std::uint8_t* pixel(int x, int y) const {
    return &rgb[(static_cast<std::size_t>(y) * width + x) * 3];
  }
};

/// Returns the 64-bit FNV-1a of size and pixels, which identifies a picture (the bytes of its PNG do not).
std::uint64_t hash(const Image& image);

/// Returns the bytes as a zlib stream, compressed by a level of 1 to 12.
std::string zlib_compressed(std::string_view bytes, int level);

/// Returns a PNG file's bytes, deterministic. The small one, a seventh smaller, is for pictures that are
/// kept.
std::string to_png(const Image& image);
std::string to_small_png(const Image& image);
void write_png(const Image& image, const std::filesystem::path& file);  ///< whole or not at all; throws Error

/// Returns a PDF file's bytes: one page that is the image, `width` mm wide.
std::string to_pdf(const Image& image, double width);

/// Returns a PNG's pixels. Throws Error, which names it `name`.
Image from_png(std::string_view bytes, const std::string& name);
Image read_png(const std::filesystem::path& file);

/// A PNG's or JPEG's pixels with alpha, 4 bytes each as they are encoded, rows from the top.
struct Texels {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;
};
/// Decodes a file. Throws Error, which calls it `name`, where it is no whole picture or has more than
/// `longest_texture` pixels a side.
Texels decode_texels(std::string_view bytes, const std::string& name);
inline constexpr int longest_texture = 8192;
/// Returns a PNG file's bytes, without alpha where all is opaque.
std::string to_png(const Texels& texels);

}  // namespace substep::render
