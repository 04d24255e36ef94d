#pragma once
/// Tracks: a short record of each frame of a run.
///
/// A golden pose log has a hash of every frame, but poses of only about every tenth. The track beside it has
/// for every frame a digest of each body, which tells the first body to change; the poses to a hundredth of a
/// millimetre, which can be drawn to find the first visible change; and invariants, which stay comparable
/// where poses do not. A track explains a verdict, and pose tolerances past a change of contacts need it
/// (motion_comparison.h). A case without a track is `missing`.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/model/model.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// Quantities that two correct runs of a chaotic scene share.
struct Invariants {
  std::uint16_t touching = 0;  ///< digest of the pairs of bodies that touch
  double energy = 0;           ///< of all bodies, J
  double penetration = 0;      ///< of the deepest contact, m, rounded to 1e-4
  int resting = 0;             ///< bodies slower than `resting_speed`
};

struct Track {
  static constexpr double resolution = 1e-5;     ///< of positions (m) and of quaternions' components
  static constexpr double resting_speed = 0.01;  ///< m/s, and rad/s
  static constexpr double touching_gap = 1e-3;   ///< m; nearer bodies count as touching

  struct Frame {
    std::vector<std::uint16_t> digests;  ///< of each body's coordinates and velocity; the world first
    std::vector<Coordinates> poses;      ///< rounded to `resolution`; the world first
    Invariants invariants;
  };
  std::vector<Frame> frames;  ///< from frame 0 on
};

/// Makes a track frame by frame, for a run of `scene` with `settings`.
class Tracker {
 public:
  Tracker(const Scene& scene, const Settings& settings);
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;
  void add(const State& state);
  Track take() { return std::move(track_); }

 private:
  Invariants invariants(const State& state);

  const Scene& scene_;
  Settings settings_;
  Model model_;
  ContactFinder finder_;
  Track track_;
};

/// Returns the track as the bytes of a file: deflated, deterministic.
std::string to_bytes(const Track& track);

/// Throws Error when the file cannot be read or is not a track.
Track read_track(const std::filesystem::path& file);

}  // namespace substep::golden
