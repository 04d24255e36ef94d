#pragma once
/// The pose log: what a run leaves, to be drawn, compared and repeated.
///
/// Text, one line an item, '\n' line ends, numbers as the shortest decimals that read back to the same bits:
///
///     substep pose log 1
///     scene box_stack.gltf
///     scene-hash 8c5e0f3a11d2b697
///     algorithm a3
///     step 0.016666666666666666          seconds
///     …                                   one line per setting
///     modelled …
///     body 1 crate                        index, name; 0 is the world and is not logged
///     full-every 10
///     frame 0 f00dfeed12345678            state hash: coordinates and velocities
///     pose 1 0 0.5 0 1 0 0 0              body, x y z (m, centre of mass, world), w x y z (body frame → world)
///     frame 1 …
///     end ok 300                          or: end diverged 17 body 3, end unsolved 17 …
///
/// A log without its `end` line is truncated, and reading it is an error.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "sim/settings.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace substep {

struct PoseLog {
  struct Frame {
    std::uint64_t hash = 0;
    std::vector<Coordinates> poses;  ///< one per body, the world included; empty when the frame is not full
  };

  std::string scene;  ///< file name with extension, relative to the log's user: not a path of the machine
  std::uint64_t scene_hash = 0;
  Settings settings;
  std::string modelled;
  std::vector<std::string> bodies;  ///< names; bodies[0] is the world
  int full_every = 1;               ///< frame k has poses when k is a multiple, and the last one has
  std::vector<Frame> frames;        ///< frame k is the state after k steps
  std::string end = "ok";           ///< "ok", or why and where the run ended early
};

PoseLog read_pose_log(const std::filesystem::path& file);  ///< throws Error with the line

std::string to_text(const PoseLog& log);

/// Written beside and renamed: a reader sees the old file or the whole new one.
void write_pose_log(const PoseLog& log, const std::filesystem::path& file);

/// Runs the simulation for `frames` steps and logs it. Ends early, and says so in `end`, when it diverges.
/// `after_frame(k)` is called after each, for progress; may be empty.
PoseLog record(Simulation& simulation, int frames, int full_every,
               const std::function<void(int)>& after_frame = {});

/// The first frame whose hashes differ, and there the body and quantity that differ most.
struct PoseDifference {
  int first_frame = -1;        ///< first frame with other hashes; −1: none
  int first_full_frame = -1;   ///< first frame at or after it with poses in both
  int body = 0;                ///< with the largest difference there
  char axis = ' ';             ///< 'x' 'y' 'z' of position, 'r' for orientation
  double size = 0;             ///< m, or rad for 'r'
  double largest_position = 0;     ///< over all full frames, m
  double largest_orientation = 0;  ///< over all full frames, rad
  std::string headers;         ///< what differs in the headers, one line each; empty: nothing
};

PoseDifference compare(const PoseLog& expected, const PoseLog& actual);

}  // namespace substep
