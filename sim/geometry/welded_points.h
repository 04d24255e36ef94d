#pragma once
/// Merges points of a mesh at equal positions.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// Returns for each point the first one at the same position, which may be itself. Points with a NaN equal no
/// other. `comparisons`, if given, receives the number of compared pairs: at most some dozens a point for any
/// input.
std::vector<std::uint32_t> welded(std::span<const Vector3> points, std::size_t* comparisons = nullptr);

/// Returns each position once, in the order of their first points.
std::vector<Vector3> distinct(std::span<const Vector3> points);

}  // namespace substep
