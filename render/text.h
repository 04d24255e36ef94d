#pragma once
/// Text in pictures: the vendored font, rasterised by stb_truetype, the same pixels on every machine.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "render/image.h"

namespace substep::render {

using Color = std::array<std::uint8_t, 3>;

struct TextStyle {
  double size = 18;  ///< pixels from ascender to descender
  Color color{255, 255, 255};
  bool bold = false;
};

/// Returns the width in pixels of UTF-8 `text` (Greek, ° × → − and the like are in the font).
double text_width(std::string_view text, const TextStyle& style);

/// Breaks text at blanks into lines of at most a width, pixels; a longer word has a line of its own.
std::vector<std::string> wrapped(std::string_view text, const TextStyle& style, double width);

/// Cuts text to a width, pixels, with an ellipsis where it was longer. Returns "" where no letter fits.
std::string cut(const std::string& text, const TextStyle& style, double width);

/// Draws with the baseline's left end at (x, y), blended; clips at the image's border.
void draw_text(Image& image, double x, double y, std::string_view text, const TextStyle& style);

/// Blends a rectangle; alpha 0–1. Clips.
void fill_rectangle(Image& image, int x, int y, int width, int height, Color color, double alpha = 1);

/// Draws an anti-aliased line, width in pixels. Clips.
void draw_line(Image& image, double x0, double y0, double x1, double y1, double width, Color color,
               double alpha = 1);

/// Copies `source` with its top left corner at (x, y); clips.
void paste(Image& image, const Image& source, int x, int y);

}  // namespace substep::render
