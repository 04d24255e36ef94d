#pragma once
/// Points of a mesh that lie at one place.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// For each point the first one at the same position, itself where there is none before it. Points with a NaN
/// are at no other's position. `comparisons`, if given, is how many pairs of points were compared: at most
/// some dozens a point, however the points were chosen.
std::vector<std::uint32_t> welded(std::span<const Vector3> points, std::size_t* comparisons = nullptr);

/// Each position once, in the order of their first points.
std::vector<Vector3> distinct(std::span<const Vector3> points);

}  // namespace substep
