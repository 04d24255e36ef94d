#include "render/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <mutex>
#include <set>
#include <string_view>
#include <tuple>
#include <vector>

#define STB_TRUETYPE_IMPLEMENTATION
#define STBTT_STATIC
#include <stb/stb_truetype.h>

// The fonts are part of the program, so that text needs no files and looks alike everywhere.
namespace substep::embedded {
std::string_view DejaVuSans_ttf();
std::string_view DejaVuSans_Bold_ttf();
}  // namespace substep::embedded

namespace substep::render {
namespace {

/// The number of distinct horizontal positions of a glyph within a pixel.
constexpr int subpixels = 4;

struct Glyph {
  int left = 0;  ///< of the bitmap, from the pen, pixels
  int top = 0;   ///< of the bitmap, from the baseline, downwards
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> coverage;
};

class Font {
 public:
  explicit Font(std::string_view file) {
    stbtt_InitFont(&info_, reinterpret_cast<const unsigned char*>(file.data()), 0);
    for (int digit = '0'; digit <= '9'; ++digit)
      digit_advance_ = std::max(digit_advance_, advance(index(digit)));
  }

  int index(int codepoint) const { return stbtt_FindGlyphIndex(&info_, codepoint); }
  float scale(double size) const { return stbtt_ScaleForPixelHeight(&info_, static_cast<float>(size)); }
  /// Returns a glyph's advance in the font's units.
  int advance(int glyph) const {
    int width = 0;
    int bearing = 0;
    stbtt_GetGlyphHMetrics(&info_, glyph, &width, &bearing);
    return width;
  }
  int digit_advance() const { return digit_advance_; }
  int kerning(int left, int right) const { return stbtt_GetGlyphKernAdvance(&info_, left, right); }

  const Glyph& glyph(int index, double size, int subpixel) {
    const auto [entry, is_new] = glyphs_.try_emplace({index, size, subpixel});
    Glyph& glyph = entry->second;
    if (is_new) {
      const float s = scale(size);
      const float shift = static_cast<float>(subpixel) / subpixels;
      int right = 0;
      int bottom = 0;
      stbtt_GetGlyphBitmapBoxSubpixel(&info_, index, s, s, shift, 0, &glyph.left, &glyph.top, &right,
                                      &bottom);
      glyph.width = right - glyph.left;
      glyph.height = bottom - glyph.top;
      glyph.coverage.resize(static_cast<std::size_t>(glyph.width) * glyph.height);
      if (!glyph.coverage.empty()) {
        stbtt_MakeGlyphBitmapSubpixel(&info_, glyph.coverage.data(), glyph.width, glyph.height, glyph.width,
                                      s, s, shift, 0, index);
      }
    }
    return glyph;
  }

 private:
  stbtt_fontinfo info_{};
  int digit_advance_ = 0;
  std::map<std::tuple<int, double, int>, Glyph> glyphs_;
};

/// Returns the thread's own font, so that glyphs are cached without locks.
Font& font(bool bold) {
  thread_local Font regular_font(embedded::DejaVuSans_ttf());
  thread_local Font bold_font(embedded::DejaVuSans_Bold_ttf());
  return bold ? bold_font : regular_font;
}

/// Removes the next code point of UTF-8 text and returns it; U+FFFD for each byte outside a code point.
int take_codepoint(std::string_view& text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
  int codepoint = length == 1 ? first : first & (0x7f >> length);
  bool whole = length > 0 && length <= text.size();
  for (std::size_t i = 1; whole && i < length; ++i) {
    whole = (byte(i) & 0xc0) == 0x80;
    codepoint = codepoint << 6 | (byte(i) & 0x3f);
  }
  text.remove_prefix(whole ? length : 1);
  return whole ? codepoint : 0xfffd;
}

/// Calls `place(glyph index, pen x)` for each glyph; returns the width.
template <typename Place>
double lay_out(std::string_view text, const TextStyle& style, const Place& place) {
  const Font& face = font(style.bold);
  const double scale = face.scale(style.size);
  double pen = 0;
  int previous = 0;
  while (!text.empty()) {
    const int codepoint = take_codepoint(text);
    const int glyph = face.index(codepoint);
    // Digits are equally wide, so that counting numbers do not dance.
    const bool in_column = codepoint >= '0' && codepoint <= '9';
    if (previous != 0 && !in_column) pen += scale * face.kerning(previous, glyph);
    const int advance = face.advance(glyph);
    const int cell = in_column ? face.digit_advance() : advance;
    place(glyph, pen + scale * (cell - advance) / 2);
    pen += scale * cell;
    previous = in_column ? 0 : glyph;
  }
  return pen;
}

/// Blends the colour over the pixel, by `weight` of 255.
void blend(std::uint8_t* pixel, const Color& color, int weight) {
  for (int c = 0; c < 3; ++c) {
    pixel[c] = static_cast<std::uint8_t>((pixel[c] * (255 - weight) + color[c] * weight + 127) / 255);
  }
}

int to_weight(double alpha) {
  return static_cast<int>(std::lround(std::clamp(alpha, 0.0, 1.0) * 255));
}

/// A rectangle [left, right) × [top, bottom) cut to the image.
struct Window {
  int left, top, right, bottom;
};

/// Clips a rectangle with real corners to the image; far-off and non-finite corners are clamped before
/// rounding.
Window clip(const Image& image, double left, double top, double right, double bottom) {
  const auto cut = [](double value, int end) {
    return static_cast<int>(value > 0 ? std::min(value, static_cast<double>(end)) : 0.0);
  };
  return {cut(left, image.width), cut(top, image.height), cut(right, image.width), cut(bottom, image.height)};
}

/// Prints a note about a text with letters that the fonts lack, once for each text.
void note_missing_letters(std::string_view text) {
  static std::mutex mutex;
  static std::set<std::string> noted;
  const std::lock_guard lock(mutex);
  if (noted.emplace(text).second)
    fmt::print(stderr, "substep: note: the font has not all letters of '{}': boxes stand for the others\n",
               text);
}

}  // namespace

double text_width(std::string_view text, const TextStyle& style) {
  return lay_out(text, style, [](int, double) {});
}

std::vector<std::string> wrapped(std::string_view text, const TextStyle& style, double width) {
  std::vector<std::string> lines{""};
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find_first_of(" \t\n"));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (word.empty()) continue;
    std::string longer = lines.back() + (lines.back().empty() ? "" : " ");
    longer += word;
    if (lines.back().empty() || text_width(longer, style) <= width) {
      lines.back() = longer;
    } else {
      lines.emplace_back(word);
    }
  }
  return lines;
}

std::string cut(const std::string& text, const TextStyle& style, double width) {
  if (text_width(text, style) <= width) return text;
  std::string shorter = text;
  while (!shorter.empty() && text_width(shorter + "…", style) > width) {
    // Remove a character of several bytes as a whole.
    while (!shorter.empty() && (static_cast<unsigned char>(shorter.back()) & 0xC0) == 0x80)
      shorter.pop_back();
    if (!shorter.empty()) shorter.pop_back();
  }
  return shorter.empty() ? shorter : shorter + "…";
}

void draw_text(Image& image, double x, double y, std::string_view text, const TextStyle& style) {
  const double reach = 1e6;
  if (!(std::abs(x) < reach && std::abs(y) < reach)) return;
  const int baseline = static_cast<int>(std::floor(y + 0.5));
  lay_out(text, style, [&](int index, double pen) {
    if (index == 0) note_missing_letters(text);
    // Put glyphs on quarters of a pixel horizontally and whole pixels vertically, which keeps stems sharp.
    const auto quarters = static_cast<std::int64_t>(std::floor((x + pen) * subpixels + 0.5));
    static_assert(subpixels == 4);
    const auto column = quarters >> 2;
    const Glyph& glyph = font(style.bold).glyph(index, style.size, static_cast<int>(quarters & 3));
    const double left = static_cast<double>(column + glyph.left);
    const double top = static_cast<double>(baseline + glyph.top);
    const Window window = clip(image, left, top, left + glyph.width, top + glyph.height);
    for (int row = window.top; row < window.bottom; ++row) {
      for (int i = window.left; i < window.right; ++i) {
        const auto from = static_cast<std::size_t>(row - baseline - glyph.top) * glyph.width +
                          static_cast<std::size_t>(i - column - glyph.left);
        blend(image.pixel(i, row), style.color, glyph.coverage[from]);
      }
    }
  });
}

void fill_rectangle(Image& image, int x, int y, int width, int height, Color color, double alpha) {
  const Window window = clip(image, x, y, static_cast<double>(x) + width, static_cast<double>(y) + height);
  const int weight = to_weight(alpha);
  for (int row = window.top; row < window.bottom; ++row) {
    for (int column = window.left; column < window.right; ++column) {
      blend(image.pixel(column, row), color, weight);
    }
  }
}

void draw_line(Image& image, double x0, double y0, double x1, double y1, double width, Color color,
               double alpha) {
  const double dx = x1 - x0;
  const double dy = y1 - y0;
  const double length_squared = dx * dx + dy * dy;
  if (!std::isfinite(length_squared)) return;
  const double reach = width / 2 + 0.5;
  const Window window = clip(image, std::min(x0, x1) - reach, std::min(y0, y1) - reach,
                             std::max(x0, x1) + reach + 1, std::max(y0, y1) + reach + 1);
  for (int row = window.top; row < window.bottom; ++row) {
    for (int column = window.left; column < window.right; ++column) {
      // Coverage falls from 1 to 0 over the pixel that the border runs through.
      const double px = column + 0.5 - x0;
      const double py = row + 0.5 - y0;
      const double along =
          length_squared > 0 ? std::clamp((px * dx + py * dy) / length_squared, 0.0, 1.0) : 0.0;
      const double ex = px - along * dx;
      const double ey = py - along * dy;
      const double coverage = std::clamp(reach - std::sqrt(ex * ex + ey * ey), 0.0, std::min(1.0, width));
      if (coverage > 0) blend(image.pixel(column, row), color, to_weight(coverage * alpha));
    }
  }
}

void paste(Image& image, const Image& source, int x, int y) {
  const Window window =
      clip(image, x, y, static_cast<double>(x) + source.width, static_cast<double>(y) + source.height);
  if (window.left >= window.right) return;
  for (int row = window.top; row < window.bottom; ++row) {
    const std::uint8_t* from = source.pixel(window.left - x, row - y);
    std::copy_n(from, static_cast<std::ptrdiff_t>(window.right - window.left) * 3,
                image.pixel(window.left, row));
  }
}

}  // namespace substep::render
