#include "golden/compare/image_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>

namespace substep::golden {
namespace {

constexpr int blank_range = 2;
constexpr int sky = -1;
constexpr int world = 0;
constexpr std::int64_t smallest_extent = 8;  // pixels: less may hide behind another body

/// Returns the largest difference of a pixel's channels.
int levels_apart(const std::uint8_t* a, const std::uint8_t* b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// Returns the bodies that were visible when the picture was approved and are not drawn any more.
std::vector<BodyExtent> gone(std::vector<BodyExtent> approved, const std::map<int, BodyBlame>& seen) {
  std::erase_if(approved, [&](const BodyExtent& extent) {
    return extent.body <= world || extent.pixels < smallest_extent || seen.contains(extent.body);
  });
  return approved;
}

/// Returns true where the sky or nearly all of the ground differs: light or camera changed, not single
/// bodies. Bodies that moved change the ground under their shadows only.
bool is_everywhere(const std::map<int, BodyBlame>& seen) {
  constexpr double most_of_sky = 0.5;
  // A weaker light changed 96 % of the ground's pixels, a narrower view 82 %.
  constexpr double nearly_all_ground = 0.75;
  const auto fraction = [&](int body) {
    const auto found = seen.find(body);
    if (found == seen.end() || found->second.pixels < smallest_extent) return -1.0;
    return static_cast<double>(found->second.differing) / static_cast<double>(found->second.pixels);
  };
  if (fraction(sky) >= 0 || fraction(world) >= 0) {
    return fraction(sky) > most_of_sky || fraction(world) > nearly_all_ground;
  }
  // In a close-up without sky and ground, all bodies must differ.
  const auto first = seen.upper_bound(world);
  const auto differs = [](const auto& entry) { return entry.second.differing * 20 > entry.second.pixels; };
  return std::distance(first, seen.end()) > 1 && std::all_of(first, seen.end(), differs);
}

}  // namespace

std::string_view name(Judgement judgement) {
  constexpr std::array<std::string_view, 5> names{"exact", "within tolerance", "size", "hard limit",
                                                  "pixel count"};
  return names[static_cast<std::size_t>(judgement)];
}

ImageComparison compare(const render::Image& expected, const render::Image& actual,
                        const ImageTolerance& tolerance) {
  ImageComparison c;
  if (expected.width != actual.width || expected.height != actual.height) {
    c.judgement = Judgement::size;
    return c;
  }
  c.pixels = std::int64_t{expected.width} * expected.height;
  if (expected.rgb == actual.rgb) return c;
  c.left = expected.width;
  c.top = expected.height;
  for (int y = 0; y < expected.height; ++y) {
    for (int x = 0; x < expected.width; ++x) {
      const int largest = levels_apart(expected.pixel(x, y), actual.pixel(x, y));
      if (largest == 0) continue;
      ++c.differing;
      if (largest > tolerance.level) ++c.above_level;
      c.left = std::min(c.left, x);
      c.right = std::max(c.right, x);
      c.top = std::min(c.top, y);
      c.bottom = y;
      if (largest <= c.max) continue;
      c.max = largest;
      c.max_x = x;
      c.max_y = y;
    }
  }
  c.judgement = c.max > tolerance.hard            ? Judgement::hard
                : c.above_level > tolerance.count ? Judgement::count
                                                  : Judgement::within;
  return c;
}

bool is_blank(const render::Image& image) {
  std::array<std::uint8_t, 3> low{255, 255, 255};
  std::array<std::uint8_t, 3> high{0, 0, 0};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], image.rgb[i]);
    high[i % 3] = std::max(high[i % 3], image.rgb[i]);
  }
  return std::ranges::equal(high, low, [](int h, int l) { return h <= l + blank_range; });
}

int body_at(const render::Image& bodies, std::size_t pixel) {
  const std::uint8_t* p = &bodies.rgb[3 * pixel];
  return p[0] + (p[1] << 8) + (p[2] << 16) - 1;
}

std::vector<BodyExtent> body_extents(const render::Image& bodies) {
  std::map<int, BodyExtent> found;
  for (int y = 0; y < bodies.height; ++y) {
    for (int x = 0; x < bodies.width; ++x) {
      const int body = body_at(bodies, static_cast<std::size_t>(y) * bodies.width + x);
      BodyExtent& extent = found.try_emplace(body, BodyExtent{body, 0, x, y, x, y}).first->second;
      ++extent.pixels;
      extent.left = std::min(extent.left, x);
      extent.right = std::max(extent.right, x);
      extent.bottom = y;
    }
  }
  std::vector<BodyExtent> result;
  for (const auto& [body, extent] : found) result.push_back(extent);
  return result;
}

Blame blame(const render::Image& expected, const render::Image& actual, const render::Image& expected_bodies,
            const render::Image& actual_bodies, const std::vector<BodyExtent>& approved,
            const std::vector<std::string>& names) {
  const int count = expected.width * expected.height;
  const auto visible_body = [&](int pixel) {
    const int body = body_at(expected_bodies, static_cast<std::size_t>(pixel));
    return body > world ? body : std::max(body, body_at(actual_bodies, static_cast<std::size_t>(pixel)));
  };
  std::map<int, BodyBlame> seen;
  for (int i = 0; i < count; ++i) ++seen[visible_body(i)].pixels;
  const std::vector<BodyExtent> absent = gone(approved, seen);
  Blame result;
  for (int i = 0; i < count; ++i) {
    const int x = i % expected.width;
    const int y = i / expected.width;
    int body = visible_body(i);
    const int levels = levels_apart(expected.pixel(x, y), actual.pixel(x, y));
    // Attribute differences of sky and ground to a missing body in whose box they are.
    const bool may_be_gone = levels > 0 && body <= world;
    for (const BodyExtent& extent : absent) {
      const bool holds = x >= extent.left && x <= extent.right && y >= extent.top && y <= extent.bottom;
      if (may_be_gone && holds) body = extent.body;
    }
    if (body > world) ++result.foreground;
    if (levels == 0) continue;
    ++seen[body].differing;
    seen[body].levels += levels;
    if (body > world) ++result.differing_foreground;
  }
  result.is_everywhere = absent.empty() && is_everywhere(seen);
  for (const BodyExtent& extent : absent) {
    seen[extent.body].is_gone = true;
    seen[extent.body].pixels = extent.pixels;
  }
  for (auto& [body, found] : seen) {
    if (found.differing == 0) continue;
    found.body = body;
    const auto index = static_cast<std::size_t>(body);
    found.name = body == sky            ? "sky"
                 : body == world        ? "ground and world"
                 : index < names.size() ? names[index]
                                        : fmt::format("body {}", body);
    result.bodies.push_back(found);
  }
  std::ranges::stable_sort(result.bodies, std::ranges::greater(), &BodyBlame::levels);
  return result;
}

}  // namespace substep::golden
