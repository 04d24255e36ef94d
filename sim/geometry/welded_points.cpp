#include "sim/geometry/welded_points.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <tuple>

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

// The same as `welded` by sorting: slower, but never by much.
std::vector<std::uint32_t> welded_by_order(std::span<const Vector3> points, std::size_t& comparisons) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  // Points with a NaN have no place in an order, nor are they at another's position.
  const auto numbers_end = std::stable_partition(
      order.begin(), order.end(), [&](std::uint32_t i) { return !points[i].array().isNaN().any(); });
  std::sort(order.begin(), numbers_end, [&](std::uint32_t i, std::uint32_t j) {
    ++comparisons;
    const Vector3& a = points[i];
    const Vector3& b = points[j];
    return std::tuple(a.x(), a.y(), a.z(), i) < std::tuple(b.x(), b.y(), b.z(), j);
  });
  std::vector<std::uint32_t> first(points.size());
  std::iota(first.begin(), first.end(), 0U);
  for (auto next = order.begin(); next != numbers_end; ++next) {
    if (next != order.begin() && points[*next] == points[*(next - 1)]) first[*next] = first[*(next - 1)];
  }
  return first;
}

}  // namespace

std::vector<std::uint32_t> welded(std::span<const Vector3> points, std::size_t* comparisons) {
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  std::size_t counted = 0;
  std::size_t& probes = comparisons != nullptr ? *comparisons : counted;
  probes = 0;
  // Points can be made so that all fall into one slot.
  const std::size_t most_probes = 1000 + 16 * points.size();
  // Open addressing, at most half full.
  std::vector<std::uint32_t> table(std::bit_ceil(2 * points.size() + 1), none);
  std::vector<std::uint32_t> first(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    std::size_t slot = hash_of(points[i]) & (table.size() - 1);
    while (table[slot] != none && points[table[slot]] != points[i]) {
      if (probes++ == most_probes) return welded_by_order(points, probes);
      slot = (slot + 1) & (table.size() - 1);
    }
    if (table[slot] == none) table[slot] = i;
    first[i] = table[slot];
  }
  return first;
}

std::vector<Vector3> distinct(std::span<const Vector3> points) {
  const std::vector<std::uint32_t> first = welded(points);
  std::vector<Vector3> result;
  result.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (first[i] == i) result.push_back(points[i]);
  }
  return result;
}

}  // namespace substep
