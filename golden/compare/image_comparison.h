#pragma once
/// Compares a picture with the golden one: extent and position of differences, and the bodies in them.
///
/// Rules in their order; the first that applies decides:
///
///  1. size      width and height must be equal;
///  2. exact     pictures with equal pixels are equal, also in files of other bytes;
///  3. hard      no channel of any pixel may differ by more than `hard` levels;
///  4. count     at most `count` pixels may have a channel that differs by more than `level` levels;
///  5. within    the remaining differences are within the tolerance.
///
/// Levels are steps of the 8-bit sRGB code, 0 to 255.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/image.h"

namespace substep::golden {

struct ImageTolerance {
  int hard = 64;
  int level = 3;
  std::int64_t count = 20;
  /// The largest accepted FLIP error of a pixel. Where it is set, the caller decides by it in place of rules
  /// 3 and 4, since two renderers that round edges differently look the same.
  std::optional<double> flip;
};

enum class Judgement { exact, within, size, hard, count };

std::string_view name(Judgement judgement);

inline bool passes(Judgement judgement) {
  return judgement == Judgement::exact || judgement == Judgement::within;
}

struct ImageComparison {
  Judgement judgement = Judgement::exact;
  std::int64_t pixels = 0;       ///< in each image; 0 when the sizes differ
  std::int64_t differing = 0;    ///< pixels
  std::int64_t above_level = 0;  ///< pixels with a channel that differs by more than the tolerance's level
  int max = 0;                   ///< largest difference of a channel, levels
  int max_x = 0, max_y = 0;      ///< the first pixel that has it, from the top left
  int left = 0, top = 0, right = -1, bottom = -1;  ///< the box of differing pixels, both ends included
};

ImageComparison compare(const render::Image& expected, const render::Image& actual,
                        const ImageTolerance& tolerance = {});

/// Returns true where no channel varies by more than two levels.
bool is_blank(const render::Image& image);

/// The pixels of a body in a picture, from an image of bodies (Renderer::draw_bodies). Body −1 is the sky, 0
/// the world with the ground.
struct BodyExtent {
  int body = 0;
  std::int64_t pixels = 0;
  int left = 0, top = 0, right = -1, bottom = -1;  ///< the box around them, both ends included
};

/// Returns the body that is seen at a pixel of an image of bodies.
int body_at(const render::Image& bodies, std::size_t pixel);

/// Returns the visible bodies, ascending.
std::vector<BodyExtent> body_extents(const render::Image& bodies);

struct BodyBlame {
  int body = 0;
  std::string name;            ///< "sky", "ground and world" or the body's
  std::int64_t differing = 0;  ///< pixels
  std::int64_t levels = 0;     ///< their differences in the channel that differs most, summed
  std::int64_t pixels = 0;     ///< pixels that show it, in either picture
  bool is_gone = false;        ///< whether only the golden picture has it
};

struct Blame {
  std::int64_t foreground = 0;            ///< pixels that show a body other than the world, in either picture
  std::int64_t differing_foreground = 0;  ///< those of them that differ
  std::vector<BodyBlame> bodies;          ///< those with differing pixels, most levels first
  bool is_everywhere = false;  ///< most of sky or ground, or all bodies, differ: by light or camera
};

/// Attributes each differing pixel to the body that the expected picture shows there or, where that is sky or
/// world, to the body in the actual picture. `approved` is where bodies were when the golden picture was
/// made: one that is drawn no more takes the differing pixels of its box. All images have one size.
Blame blame(const render::Image& expected, const render::Image& actual, const render::Image& expected_bodies,
            const render::Image& actual_bodies, const std::vector<BodyExtent>& approved,
            const std::vector<std::string>& names);

}  // namespace substep::golden
