#pragma once
/// The pose table: a run as CSV (RFC 4180), which `run --csv` writes and any other program can. A header,
/// then a row per time and body:
///
///     t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz
///     0,crate,0,0.5,0,1,0,0,0,0,0,0,0,0,0
///
/// Seconds, the body's name in the scene, its centre of mass (m), the orientation of its node (unit
/// quaternion node → world), and, all six or none, its linear and angular velocity (m/s, rad/s), in the
/// world. Columns may be in any order, and unknown ones are ignored. Every dynamic or pivoting body needs the
/// same number of rows, from t = 0 on and in the order of time; kinematic bodies need none.

#include <filesystem>
#include <string>
#include <vector>

#include "sim/log/pose_log.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns true where the file's name is that of a pose table: *.csv.
bool is_pose_table(const std::filesystem::path& file);

/// Reads a table and returns the states at 0, step, 2 step … up to its last time: positions and velocities
/// linear between rows, orientations by slerp. Velocities that the table lacks are differences of poses, and
/// the scene's own at the start. Memory grows with the states and not with the rows. Throws Error with the
/// line.
std::vector<State> read_pose_table(const std::filesystem::path& file, const Scene& scene, double step);

/// Returns the states as a log of a run by the program `author`.
PoseLog log_of(const std::vector<State>& states, const Scene& scene, double step, const std::string& author);

/// Reads a pose log of `scene` or, at multiples of `step`, a pose table, whose author is the file's name
/// without extension. Throws Error with the line, or if the log is of another scene or of another version of
/// it.
PoseLog read_run(const std::filesystem::path& file, const Scene& scene, double step);

}  // namespace substep
