#pragma once
/// Prints states as lines of a CSV table.

#include <string>
#include <string_view>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// Seconds, a body's name, its centre of mass (m), the orientation of its node, and its velocities (m/s,
/// rad/s), in the world.
inline constexpr std::string_view csv_columns = "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";

/// Returns a line of these columns for each body that can move, with `more` at the end of each.
std::string csv_lines(const Scene& scene, const State& state, double time, std::string_view more = "");

}  // namespace substep
