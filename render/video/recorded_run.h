#pragma once
/// The runs of a film's panels, kept at the steps that the film shows.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "render/video/comparison.h"
#include "sim/log/pose_log.h"
#include "sim/study/engines/engines.h"

namespace substep::render {

/// Times of a film's frames.
struct FrameTimes {
  double start = 0;            ///< s, of the first frame
  double duration = 5;         ///< s, at or before which the last frame is
  double interval = 1.0 / 30;  ///< s

  std::vector<double> times() const;
};

/// The steps that a run keeps for a film. Runs of one comparison keep the same instants.
struct FrameClock {
  /// A frame's position between kept steps: `weight` of the way from `before` to the next one.
  struct Position {
    std::size_t before = 0;
    double weight = 0;
  };
  std::vector<std::int64_t> steps;  ///< ascending
  std::vector<Position> positions;  ///< of each frame

  /// Returns the number of frames that can be shown with the first `kept` steps.
  std::size_t frames_of(std::size_t kept) const;
};

/// Returns a clock for each step length, s. Where frames lie between steps, all clocks keep multiples of the
/// longest step, so that errors compare one instant with itself. Throws Error where steps do not divide it.
std::vector<FrameClock> frame_clocks(const FrameTimes& frames, const std::vector<double>& steps);

/// Turns values at kept steps into values at frames. Positions and numbers are interpolated linearly,
/// orientations by slerp; contacts are those of the later step.
template <typename Value>
void spread(const FrameClock& clock, std::vector<Value>& values);

/// Steps of all runs that are simulated at once.
struct Tally {
  std::atomic<std::int64_t> done{0};
  std::atomic<bool> stop{false};
};

/// Makes the clock's steps, each in `parts`, and keeps their poses. Returns false once `step` does.
bool keep_steps(const FrameClock& clock, int parts, Tally& tally, const std::function<bool()>& step,
                const std::function<const State&()>& state, std::vector<std::vector<Coordinates>>& poses,
                std::int64_t& steps, const std::function<void(const State&)>& read = {});

/// Simulates an algorithm's run.
void simulate_algorithm(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice, Run& run,
                        Tally& tally);

/// Returns the stepper of a panel's engine for `duration` s. Where the engine cannot simulate the scene,
/// returns null and stores the reason in the run.
std::unique_ptr<Stepper> engine_stepper(const Scene& scene, double duration, Run& run);

/// Simulates an engine's run.
void simulate_engine(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice,
                     Stepper& stepper, Run& run, Tally& tally);

/// Takes a run's poses from a log. Throws Error where it ends before the film does.
void take_frames(const PoseLog& log, const FrameClock& clock, Run& run);

/// Reads at all kept steps the quantities that follow from the poses alone.
void read_poses(const Scene& scene, const ReadingChoice& choice, Run& run);

/// Turns a run's values at kept steps into values at frames, `interval` s apart, and sets its RMS error.
/// Speeds that were not read follow from the poses of neighbouring frames.
void spread(const FrameClock& clock, double interval, const ReadingChoice& choice, Run& run);

}  // namespace substep::render
