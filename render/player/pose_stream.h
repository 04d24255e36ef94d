#pragma once
/// The poses of a run in few bytes, for a page.

#include <span>
#include <string>
#include <vector>

#include "sim/model/state.h"

namespace substep::render {

/// Parts of the unit in which a quaternion's components are kept: a turn is known to 3e-5 rad.
inline constexpr double turn_parts = 65536;

/// What positions are kept in multiples of: the largest power of two, m, that is at most 4e-6 of the
/// scene's size.
double position_unit(double size);

/// Frame by frame how each of the seven numbers of each pose but the world's changes: body by body x, y, z
/// and the quaternion's x, y, z, w. Whole numbers of the units above, zigzag (0, −1, 1, −2 … as 0, 1, 2, 3 …)
/// in groups of seven bits, the lowest first, the eighth bit where more follow. What is not finite stays as
/// it was; positions end at 1e5 m. Of the two quaternions of a rotation the one near the last.
std::string pose_stream(std::span<const std::vector<Coordinates>> frames, double unit);

}  // namespace substep::render
