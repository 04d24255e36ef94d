#pragma once
/// Runs of one panel each, kept at the steps that a film shows.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "render/video/comparison.h"
#include "render/video/frame_clock.h"
#include "sim/log/pose_log.h"
#include "sim/study/engines/engines.h"

namespace substep::render {

/// Steps of all runs that are simulated at once.
struct Tally {
  std::atomic<std::int64_t> done{0};
  std::atomic<bool> stop{false};
};

/// Makes the clock's steps and keeps their poses. Returns false where `step` says that there is no more.
bool take_shots(const FrameClock& clock, int steps_per_shot, Tally& tally, const std::function<bool()>& step,
                const std::function<const State&()>& state, std::vector<std::vector<Coordinates>>& poses,
                std::int64_t& steps, const std::function<void(const State&)>& read = {});

/// Simulates an algorithm's run.
void simulate_algorithm(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice, Run& run,
                        Tally& tally);

/// Returns the stepper of a panel's engine, which is run as far as the film goes where it is a command.
/// Nothing where it cannot do the scene, which the run then says.
std::unique_ptr<Stepper> engine_stepper(const Scene& scene, double duration, Run& run);

/// Simulates an engine's run.
void simulate_engine(const Scene& scene, const FrameClock& clock, const ReadingChoice& choice,
                     Stepper& stepper, Run& run, Tally& tally);

/// Takes a run's poses from a log. Throws Error where it ends before the film does.
void take_frames(const PoseLog& log, const FrameClock& clock, Run& run);

/// Reads at all kept steps what follows from the poses alone.
void read_poses(const Scene& scene, const ReadingChoice& choice, Run& run);

/// Reads speeds of a run of which the poses alone are known: by the way since the frame before.
void read_speeds(const Run& run, double interval, Readings& readings);

}  // namespace substep::render
