#pragma once
/// The pose log: the record of a run, from which it is rendered, compared and repeated.
///
/// Text, one line per item, '\n' line ends, numbers as the shortest decimals that read back to the same bits:
///
///     substep pose log 1
///     units metres seconds radians
///     scene box_stack.gltf
///     scene-hash 8c5e0f3a11d2b697
///     algorithm a3                        a line for each field of Settings, as in settings_fields.h; or
///                                         `author NAME` and the step alone (pose_table.h)
///     step 0.016666666666666666
///     …
///     modelled …
///     body 1 crate                        index, name; 0 is the world and is not logged
///     full-every 10
///     frame 0 f00dfeed12345678            hash of the state (hash() of state.h)
///     pose 1 0 0.5 0 1 0 0 0              body, x y z (m, centre of mass, world), w x y z (body → world)
///     frame 1 …
///     end ok 300                          the last frame
///
/// The last line may also be `end diverged 17 body 3 crate`: step 17 diverged, frame 16 is the last. Or
/// `end unsolved 17 steps 2`: all frames are there, 2 steps were not solved, the first of them is 17.
///
/// In names, a control character or a backslash is written as \x and two hexadecimal digits.
/// A log without its `end` line is truncated, and reading it is an error; so are another version, a number
/// that is not finite, and a missing or surplus pose. The text after the step of `end` is not checked.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/simulation.h"

namespace substep {

struct PoseLog {
  struct Frame {
    std::uint64_t hash = 0;
    std::vector<Coordinates> poses;  ///< one per body, the world included; empty when the frame is not full
    std::vector<Velocity> velocities{};  ///< of pose tables, which a log's text does not hold; else empty
  };

  std::string scene;  ///< file name with extension, without its folder
  std::uint64_t scene_hash = 0;
  /// Name of the other program that made the run; only the step of the settings is then known.
  std::string author;
  Settings settings;
  std::string modelled;             ///< parts of the model that the scene needs: Simulation::modelled()
  std::vector<std::string> bodies;  ///< names; bodies[0] is the world
  int full_every = 1;               ///< frame k has poses where k is a multiple; the last frame always has
  std::vector<Frame> frames;        ///< frame k is the state after k steps
  /// "ok", or how the run failed: "diverged 17 body 3 crate", "unsolved 17 steps 2".
  std::string end = "ok";

  /// True where the setting of this name is known.
  bool has_setting(std::string_view name) const { return author.empty() || name == "step"; }
};

PoseLog read_pose_log(const std::filesystem::path& file);  ///< throws Error with the line

/// Reads a log from text; errors begin with `what` and the line.
PoseLog parse_pose_log(std::string_view text, const std::string& what);

std::string to_text(const PoseLog& log);

/// A function that is called after each step with the frame's number and the step's report.
using AfterFrame = std::function<void(int frame, const StepReport& report)>;

/// Runs the simulation for `frames` steps and logs it. Ends early when it diverges. `end` reports this, and
/// steps that were not solved. Throws Error when `full_every` is below 1.
PoseLog record(Simulation& simulation, int frames, int full_every, const AfterFrame& after_frame = {});

/// The result of record_to().
struct WrittenRun {
  int last_frame = 0;
  std::string end = "ok";  ///< as PoseLog::end
};

/// Records to `file`, which appears only when it is complete. Memory does not grow with the frames.
WrittenRun record_to(const std::filesystem::path& file, Simulation& simulation, int frames, int full_every,
                     const AfterFrame& after_frame = {});

/// The difference of two poses of a body.
struct BodyDifference {
  char axis = ' ';         ///< 'x' 'y' 'z' of position, 'r' for orientation; ' ' where the poses are equal
  double position = 0;     ///< m, the largest of the three
  double orientation = 0;  ///< rad

  double size() const { return axis == 'r' ? orientation : position; }
  /// Compares positions first, since a rotated ball can look the same.
  bool is_larger_than(const BodyDifference& other) const {
    return position != other.position ? position > other.position : orientation > other.orientation;
  }
};

/// Returns the difference of two poses. Quaternions of opposite signs are equal orientations.
BodyDifference difference(const Coordinates& a, const Coordinates& b);

/// The first frame whose hashes differ, and there the body and quantity that differ most.
struct PoseDifference {
  int first_frame = -1;  ///< first frame whose hashes differ or that one log lacks; −1: none
  /// First frame with equal hashes but different poses, so that one of the logs is not from a run; −1: none
  int first_contradiction = -1;
  int first_full_frame = -1;    ///< first frame from `first_frame` on with poses in both
  int body = 0;                 ///< with the largest difference in that frame
  char axis = ' ';              ///< 'x' 'y' 'z' of position, 'r' for orientation; ' ' where poses are equal
  double size = 0;              ///< m, or rad for 'r'
  double largest_position = 0;  ///< over all full frames, m
  double largest_orientation = 0;  ///< over all full frames, rad
  std::string headers;             ///< differences of the headers and the end, one line each; empty: none

  /// True where the logs are equal.
  bool none() const { return first_frame < 0 && first_contradiction < 0 && headers.empty(); }
};

/// Compares all frames, poses and headers.
PoseDifference compare(const PoseLog& expected, const PoseLog& actual);

}  // namespace substep
