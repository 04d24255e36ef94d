#include "golden/compare/blame.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>

namespace substep::golden {
namespace {

constexpr int sky = -1;
constexpr int world = 0;
constexpr std::int64_t smallest_extent = 8;  // pixels: less may hide behind another body

int body_at(const render::Image& expected_bodies, const render::Image& actual_bodies, std::size_t pixel) {
  const int expected = golden::body_at(expected_bodies, pixel);
  return expected > world ? expected : std::max(expected, golden::body_at(actual_bodies, pixel));
}

bool differs(const render::Image& expected, const render::Image& actual, std::size_t pixel) {
  return std::memcmp(&expected.rgb[3 * pixel], &actual.rgb[3 * pixel], 3) != 0;
}

int levels_apart(const render::Image& expected, const render::Image& actual, std::size_t pixel) {
  int largest = 0;
  for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
    largest = std::max(largest, std::abs(expected.rgb[i] - actual.rgb[i]));
  }
  return largest;
}

std::string name_of(int body, const std::vector<std::string>& names) {
  if (body == sky) return "sky";
  if (body == world) return "ground and world";
  const auto index = static_cast<std::size_t>(body);
  return index < names.size() ? names[index] : "body " + std::to_string(body);
}

bool holds(const BodyExtent& extent, int x, int y) {
  return x >= extent.left && x <= extent.right && y >= extent.top && y <= extent.bottom;
}

/// Bodies that were seen and are not any more.
std::vector<BodyExtent> gone(const std::vector<BodyExtent>& approved, const std::map<int, BodyBlame>& seen) {
  std::vector<BodyExtent> result;
  for (const BodyExtent& extent : approved) {
    const bool is_seen = seen.count(extent.body) != 0;
    if (extent.body > world && extent.pixels >= smallest_extent && !is_seen) result.push_back(extent);
  }
  return result;
}

/// Returns true where the sky or nearly all of the ground differs: light or camera changed, not single
/// bodies. Bodies that moved change the ground under their shadows only.
bool is_everywhere(const std::map<int, BodyBlame>& seen) {
  constexpr double most_of_sky = 0.5;
  // A weaker light changed 96 % of the ground's pixels, a narrower view 82 %.
  constexpr double nearly_all_ground = 0.75;
  const auto share = [&](int body) {
    const auto found = seen.find(body);
    if (found == seen.end() || found->second.pixels < smallest_extent) return -1.0;
    return static_cast<double>(found->second.differing) / static_cast<double>(found->second.pixels);
  };
  if (share(sky) >= 0 || share(world) >= 0) {
    return share(sky) > most_of_sky || share(world) > nearly_all_ground;
  }
  // Seen from so near that there are bodies alone: all of them, then.
  std::int64_t bodies = 0;
  std::int64_t touched = 0;
  for (const auto& [body, found] : seen) {
    if (body <= world) continue;
    ++bodies;
    if (found.differing * 20 > found.pixels) ++touched;
  }
  return bodies > 1 && touched == bodies;
}

}  // namespace

int body_at(const render::Image& bodies, std::size_t pixel) {
  const std::uint8_t* p = &bodies.rgb[3 * pixel];
  return p[0] + (p[1] << 8) + (p[2] << 16) - 1;
}

std::vector<BodyExtent> body_extents(const render::Image& bodies) {
  std::map<int, BodyExtent> found;
  for (int y = 0; y < bodies.height; ++y) {
    for (int x = 0; x < bodies.width; ++x) {
      const int body = body_at(bodies, static_cast<std::size_t>(y) * bodies.width + x);
      const auto [at, is_new] = found.try_emplace(body, BodyExtent{body, 0, x, y, x, y});
      BodyExtent& extent = at->second;
      ++extent.pixels;
      extent.left = std::min(extent.left, x);
      extent.right = std::max(extent.right, x);
      extent.bottom = y;
    }
  }
  std::vector<BodyExtent> result;
  result.reserve(found.size());
  for (const auto& [body, extent] : found) result.push_back(extent);
  return result;
}

Blame blame(const render::Image& expected, const render::Image& actual, const render::Image& expected_bodies,
            const render::Image& actual_bodies, const std::vector<BodyExtent>& approved,
            const std::vector<std::string>& names) {
  const std::size_t count = static_cast<std::size_t>(expected.width) * expected.height;
  std::map<int, BodyBlame> seen;
  for (std::size_t i = 0; i < count; ++i) ++seen[body_at(expected_bodies, actual_bodies, i)].pixels;
  const std::vector<BodyExtent> absent = gone(approved, seen);
  Blame result;
  for (std::size_t i = 0; i < count; ++i) {
    int body = body_at(expected_bodies, actual_bodies, i);
    if (body <= world && differs(expected, actual, i)) {
      const int x = static_cast<int>(i) % expected.width;
      const int y = static_cast<int>(i) / expected.width;
      for (const BodyExtent& extent : absent) {
        if (holds(extent, x, y)) body = extent.body;
      }
    }
    if (body > world) ++result.foreground;
    if (!differs(expected, actual, i)) continue;
    ++seen[body].differing;
    seen[body].levels += levels_apart(expected, actual, i);
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
    found.name = name_of(body, names);
    result.bodies.push_back(found);
  }
  std::stable_sort(result.bodies.begin(), result.bodies.end(),
                   [](const BodyBlame& a, const BodyBlame& b) { return a.levels > b.levels; });
  return result;
}

}  // namespace substep::golden
