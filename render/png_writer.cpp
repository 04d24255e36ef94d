#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "render/animated_png.h"
#include "render/image.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

/// PNG's five filters: what a byte is written as a difference from.
enum Filter : std::uint8_t { none, left, above, average, paeth };
constexpr std::array<Filter, 5> filters{none, left, above, average, paeth};

/// Of a pixel without alpha.
constexpr std::size_t opaque_bytes = 3;

class Deflater {
 public:
  explicit Deflater(int level)
      : compressor_(libdeflate_alloc_compressor(level), &libdeflate_free_compressor) {
    if (!compressor_) throw std::bad_alloc();
  }

  std::string operator()(std::string_view bytes) const {
    std::string result(libdeflate_zlib_compress_bound(compressor_.get(), bytes.size()), '\0');
    result.resize(libdeflate_zlib_compress(compressor_.get(), bytes.data(), bytes.size(), result.data(),
                                           result.size()));
    return result;
  }

 private:
  std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor_;
};

void append_number(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift & 0xff));
}

void append_chunk(std::string& file, std::string_view kind, std::string_view content) {
  append_number(file, static_cast<std::uint32_t>(content.size()));
  const std::size_t checked = file.size();
  file.append(kind).append(content);
  append_number(file, libdeflate_crc32(0, file.data() + checked, file.size() - checked));
}

/// The neighbour that left + above − diagonal is nearest to.
int nearest_neighbour(int left_byte, int above_byte, int diagonal) {
  const int to_left = std::abs(above_byte - diagonal);
  const int to_above = std::abs(left_byte - diagonal);
  const int to_diagonal = std::abs(left_byte + above_byte - 2 * diagonal);
  if (to_left <= to_above && to_left <= to_diagonal) return left_byte;
  return to_above <= to_diagonal ? above_byte : diagonal;
}

/// What is written of an image: `pixel_bytes` bytes a pixel, rows from the top.
struct Rows {
  const std::uint8_t* bytes;
  int width;
  int height;
  std::size_t pixel_bytes;

  Rows(const Image& image)
      : bytes(image.rgb.data()), width(image.width), height(image.height), pixel_bytes(opaque_bytes) {}
  Rows(const Texels& texels)
      : bytes(texels.rgba.data()), width(texels.width), height(texels.height), pixel_bytes(4) {}

  std::size_t row_bytes() const { return static_cast<std::size_t>(width) * pixel_bytes; }
};

/// Row y as PNG has it: the filter, then the filtered bytes.
std::string filtered_row(const Rows& image, int y, Filter filter) {
  const std::size_t row_bytes = image.row_bytes();
  const std::size_t pixel_bytes = image.pixel_bytes;
  const std::uint8_t* row = image.bytes + static_cast<std::size_t>(y) * row_bytes;
  const std::uint8_t* previous = y > 0 ? row - row_bytes : nullptr;
  std::string bytes(1, static_cast<char>(filter));
  bytes.reserve(row_bytes + 1);
  const auto write = [&](auto predict) {
    for (std::size_t i = 0; i < row_bytes; ++i) {
      const bool has_left = i >= pixel_bytes;
      const int a = has_left ? row[i - pixel_bytes] : 0;
      const int b = previous ? previous[i] : 0;
      const int c = has_left && previous ? previous[i - pixel_bytes] : 0;
      bytes.push_back(static_cast<char>(row[i] - predict(a, b, c)));
    }
  };
  switch (filter) {
    case none:
      write([](int, int, int) { return 0; });
      break;
    case left:
      write([](int a, int, int) { return a; });
      break;
    case above:
      write([](int, int b, int) { return b; });
      break;
    case average:
      write([](int a, int b, int) { return (a + b) / 2; });
      break;
    case paeth:
      write(nearest_neighbour);
      break;
  }
  return bytes;
}

std::string rows_with(const Rows& image, Filter filter) {
  std::string rows;
  for (int y = 0; y < image.height; ++y) rows += filtered_row(image, y, filter);
  return rows;
}

/// Each row with the filter that makes it and the rows above it deflate to the fewest bytes.
std::string rows_tried_one_by_one(const Rows& image) {
  constexpr std::size_t rows_above = 8;
  const std::size_t reach = rows_above * (image.row_bytes() + 1);
  const Deflater quick(6);
  std::string rows;
  for (int y = 0; y < image.height; ++y) {
    const std::string context = rows.substr(rows.size() - std::min(rows.size(), reach));
    std::string best;
    std::size_t fewest = SIZE_MAX;
    for (const Filter filter : filters) {
      std::string row = filtered_row(image, y, filter);
      const std::size_t bytes = quick(context + row).size();
      if (bytes >= fewest) continue;
      fewest = bytes;
      best = std::move(row);
    }
    rows += best;
  }
  return rows;
}

/// Signature and header.
std::string start_of(const Rows& image) {
  std::string file = "\x89PNG\r\n\x1a\n";
  std::string header;
  append_number(header, static_cast<std::uint32_t>(image.width));
  append_number(header, static_cast<std::uint32_t>(image.height));
  const char colors = image.pixel_bytes == opaque_bytes ? 2 : 6;  // red, green and blue; with alpha
  header.append({8, colors, 0, 0, 0});                            // of 8 bits, not interlaced
  append_chunk(file, "IHDR", header);
  return file;
}

std::string png_of(const Rows& image, std::string_view compressed) {
  std::string file = start_of(image);
  append_chunk(file, "IDAT", compressed);
  append_chunk(file, "IEND", "");
  return file;
}

/// Pixels as they are compressed where it must take little time: this filter with this level gave the
/// smallest files.
std::string quickly_compressed(const Image& image) {
  return Deflater(3)(rows_with(image, left));
}

/// A rectangle of an image, and where it was.
struct Cutting {
  Image image;
  int x = 0;
  int y = 0;
};

/// Where `image` differs from the one before; of equal ones a pixel, for a frame cannot be empty.
Cutting changed_part(const Image& before, const Image& image) {
  int left_end = image.width, top = image.height, right_end = 0, bottom = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (std::equal(image.pixel(x, y), image.pixel(x, y) + opaque_bytes, before.pixel(x, y))) continue;
      left_end = std::min(left_end, x);
      right_end = std::max(right_end, x + 1);
      top = std::min(top, y);
      bottom = y + 1;
    }
  }
  if (right_end == 0) left_end = top = 0, right_end = bottom = 1;
  Cutting part{Image(right_end - left_end, bottom - top), left_end, top};
  for (int y = 0; y < part.image.height; ++y) {
    std::copy_n(image.pixel(left_end, top + y), opaque_bytes * static_cast<std::size_t>(part.image.width),
                part.image.pixel(0, y));
  }
  return part;
}

void append_frame_control(std::string& file, std::uint32_t sequence, const Cutting& part, int milliseconds) {
  std::string control;
  append_number(control, sequence);
  for (const int value : {part.image.width, part.image.height, part.x, part.y}) {
    append_number(control, static_cast<std::uint32_t>(value));
  }
  // A fraction of seconds, 16 bits each.
  append_number(control, static_cast<std::uint32_t>(milliseconds) << 16 | 1000);
  control.append({0, 0});  // what was there stays, and is written over
  append_chunk(file, "fcTL", control);
}

void require_pixels(const Image& image) {
  if (image.width <= 0 || image.height <= 0) throw Error("an image without pixels cannot be written as PNG");
}

}  // namespace

std::string to_png(const Image& image) {
  require_pixels(image);
  return png_of(image, quickly_compressed(image));
}

std::string to_animated_png(std::span<const Image> frames, int milliseconds_each) {
  require_pixels(frames.front());
  std::string file = start_of(frames.front());
  std::string control;
  append_number(control, static_cast<std::uint32_t>(frames.size()));
  append_number(control, 0);  // for ever
  append_chunk(file, "acTL", control);
  std::uint32_t sequence = 0;
  append_frame_control(file, sequence++, {frames.front()}, milliseconds_each);
  append_chunk(file, "IDAT", quickly_compressed(frames.front()));
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const Cutting part = changed_part(frames[i - 1], frames[i]);
    append_frame_control(file, sequence++, part, milliseconds_each);
    std::string data;
    append_number(data, sequence++);
    append_chunk(file, "fdAT", data + quickly_compressed(part.image));
  }
  append_chunk(file, "IEND", "");
  return file;
}

std::string to_small_png(const Image& image) {
  require_pixels(image);
  const Deflater thorough(12);
  std::string smallest = thorough(rows_tried_one_by_one(image));
  // Of the 237 goldens 43 % are smallest with one filter throughout, most of them without any.
  for (const Filter filter : {none, left, paeth}) {
    std::string bytes = thorough(rows_with(image, filter));
    if (bytes.size() < smallest.size()) smallest = std::move(bytes);
  }
  return png_of(image, smallest);
}

std::string to_png(const Texels& texels) {
  if (texels.width <= 0 || texels.height <= 0)
    throw Error("an image without pixels cannot be written as PNG");
  bool is_opaque = true;
  for (std::size_t i = 3; i < texels.rgba.size(); i += 4) is_opaque = is_opaque && texels.rgba[i] == 255;
  const Deflater thorough(9);
  if (!is_opaque) return png_of(texels, thorough(rows_with(texels, paeth)));
  Image image(texels.width, texels.height);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = texels.rgba[i / 3 * 4 + i % 3];
  return png_of(image, thorough(rows_with(image, paeth)));
}

void write_png(const Image& image, const std::filesystem::path& file) {
  write_file(file, to_png(image));
}

}  // namespace substep::render
