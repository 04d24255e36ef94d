#pragma once
/// Compresses the poses of a run, for a page.

#include <span>
#include <string>
#include <vector>

#include "sim/model/state.h"

namespace substep::render {

/// Steps per unit in which a quaternion's components are stored: rotations are exact to 3e-5 rad.
inline constexpr double turn_parts = 65536;

/// Returns the quantum of stored positions, m: the largest power of two that is at most 4e-6 of the scene's
/// size.
double position_unit(double size);

/// Returns the changes of each pose but the world's, frame by frame and body by body: x, y, z and the
/// quaternion's x, y, z, w. They are whole numbers of the units above, in zigzag (0, −1, 1, −2 … as 0, 1, 2,
/// 3 …), in groups of seven bits, the lowest first; the eighth bit is set where more follow. Numbers that are
/// not finite do not change, and positions are clamped to 1e5 m. Of a rotation's two quaternions the nearer
/// to the last is stored.
std::string pose_stream(std::span<const std::vector<Coordinates>> frames, double unit);

}  // namespace substep::render
