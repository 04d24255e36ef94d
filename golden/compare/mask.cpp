#include "golden/compare/mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "golden/compare/blame.h"
#include "sim/error.h"

namespace substep {
namespace {

/// Which pixels a mask covers, row by row.
std::vector<bool> box_pixels(const PixelBox& box, int width, int height) {
  std::vector<bool> covered(static_cast<std::size_t>(width) * height);
  for (int y = box.top; y < box.top + box.height; ++y) {
    for (int x = box.left; x < box.left + box.width; ++x) {
      covered[static_cast<std::size_t>(y) * width + x] = true;
    }
  }
  return covered;
}

std::vector<bool> body_pixels(int body, const Image& bodies) {
  const int width = bodies.width;
  std::vector<bool> covered(static_cast<std::size_t>(width) * bodies.height);
  for (int y = 0; y < bodies.height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (body_at(bodies, static_cast<std::size_t>(y) * width + x) != body) continue;
      for (int near_y = std::max(y - 1, 0); near_y <= std::min(y + 1, bodies.height - 1); ++near_y) {
        for (int near_x = std::max(x - 1, 0); near_x <= std::min(x + 1, width - 1); ++near_x) {
          covered[static_cast<std::size_t>(near_y) * width + near_x] = true;
        }
      }
    }
  }
  return covered;
}

std::vector<bool> pixels_of(const Mask& mask, const Image& bodies, const std::vector<std::string>& names) {
  if (mask.box) return box_pixels(*mask.box, bodies.width, bodies.height);
  const auto body = std::find(names.begin(), names.end(), mask.body) - names.begin();
  return body_pixels(static_cast<int>(body), bodies);
}

void copy_pixels(const Image& from, const std::vector<bool>& covered, Image& to) {
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i]) std::copy_n(&from.rgb[3 * i], 3, &to.rgb[3 * i]);
  }
}

void mark_masked(const std::vector<bool>& covered, Image& bodies) {
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i]) set_body(bodies, i, masked_body);
  }
}

MaskedPart judge(const Mask& mask, const std::vector<bool>& covered, const Image& expected,
                 const Image& actual) {
  MaskedPart part;
  part.what = mask.text();
  part.reason = mask.reason;
  part.pixels = std::count(covered.begin(), covered.end(), true);
  Image inside = actual;
  copy_pixels(expected, covered, inside);
  ImageTolerance tolerance = mask.tolerance.value_or(ImageTolerance());
  // Means are over whole pictures and tiles.
  tolerance.mean = tolerance.tile_mean = std::numeric_limits<double>::infinity();
  const ImageComparison found = compare(inside, actual, tolerance);
  part.differing = found.above[0];
  part.max = found.max;
  if (!mask.tolerance) return part;
  part.passes = passes(found.judgement);
  part.above = fmt::format("{} px > {} levels", found.above_level, tolerance.level);
  part.limit = fmt::format("{} px > {} levels, none > {}", tolerance.count, tolerance.level, tolerance.hard);
  return part;
}

}  // namespace

std::string Mask::text() const {
  if (!box) return fmt::format("body {}", body);
  return fmt::format("box [{}, {}, {}, {}]", box->left, box->top, box->width, box->height);
}

std::string MaskedPart::found() const {
  if (differing == 0) return fmt::format("none of {} px differs", pixels);
  std::string text =
      fmt::format("{} of {} px differ, most by {} level{}", differing, pixels, max, max == 1 ? "" : "s");
  return above.empty() ? text : fmt::format("{}, {}", text, above);
}

std::string MaskedPart::text() const {
  std::string text = fmt::format("{} ({}): {}", what, reason, found());
  if (limit.empty()) return text;
  return fmt::format("{}; {} its tolerance, {}", text, passes ? "within" : "beyond", limit);
}

MaskedPicture masked(const Image& expected, const Image& actual, const Image& bodies,
                     std::span<const Mask> masks, const std::vector<std::string>& names) {
  MaskedPicture result{expected, bodies, {}};
  std::vector<bool> ignored(static_cast<std::size_t>(expected.width) * expected.height);
  for (const Mask& mask : masks) {
    const std::vector<bool> covered = pixels_of(mask, bodies, names);
    result.parts.push_back(judge(mask, covered, expected, actual));
    if (result.parts.back().passes) {
      copy_pixels(actual, covered, result.expected);
      mark_masked(covered, result.bodies);
    }
    if (mask.tolerance) continue;
    for (std::size_t i = 0; i < covered.size(); ++i) ignored[i] = ignored[i] || covered[i];
  }
  if (!masks.empty() && std::find(ignored.begin(), ignored.end(), false) == ignored.end()) {
    throw Error("the masks cover all of a picture, so that nothing of it would be compared");
  }
  return result;
}

}  // namespace substep
