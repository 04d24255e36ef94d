#include "sim/geometry/welded_points.h"

#include <bit>
#include <limits>

namespace substep {
namespace {

std::uint64_t hash_of(const Vector3& point) {
  std::uint64_t hash = 0;
  for (const double coordinate : {point.x(), point.y(), point.z()}) {
    // Adding zero makes -0 the 0 that it is equal to.
    hash = (hash ^ std::bit_cast<std::uint64_t>(coordinate + 0.0)) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  }
  return hash;
}

}  // namespace

std::vector<std::uint32_t> welded(std::span<const Vector3> points) {
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  // Open addressing, at most half full.
  std::vector<std::uint32_t> table(std::bit_ceil(2 * points.size() + 1), none);
  std::vector<std::uint32_t> first(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::size_t slot = hash_of(points[i]) & (table.size() - 1);
    while (table[slot] != none && points[table[slot]] != points[i]) slot = (slot + 1) & (table.size() - 1);
    if (table[slot] == none) table[slot] = i;
    first[i] = table[slot];
  }
  return first;
}

}  // namespace substep
