#pragma once
/// The runs of a film's panels and of its reference, kept at the steps that the film shows.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/video/comparison.h"
#include "sim/log/pose_log.h"
#include "sim/math/vector.h"

namespace substep::render {

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

/// Returns the times of the film's frames, s.
std::vector<double> frame_times(const ComparisonSettings& settings);

/// Returns a clock for each step length, s, of frames that are `interval` s apart. Where frames lie between
/// steps, all clocks keep multiples of the longest step, so that errors compare one instant with itself.
/// Throws Error where steps do not divide it.
std::vector<FrameClock> frame_clocks(const std::vector<double>& times, double interval,
                                     const std::vector<double>& steps);

/// Steps of all runs that are simulated at once.
struct Tally {
  std::atomic<std::int64_t> done{0};
  std::atomic<bool> stop{false};
};

/// Makes the clock's steps, each in `parts`, counts them in `steps` and calls `keep` at those that the clock
/// keeps. Returns false once `step` does.
bool keep_steps(const FrameClock& clock, int parts, Tally& tally, std::int64_t& steps,
                const std::function<bool()>& step, const std::function<void()>& keep);

/// Simulates an algorithm's run.
void simulate_algorithm(const Scene& scene, const FrameClock& clock, const QuantityChoice& choice, Run& run,
                        Tally& tally);

/// Returns the stepper of a panel's engine for `duration` s. Where the engine cannot simulate the scene,
/// returns null and stores the reason in the run.
std::unique_ptr<Stepper> engine_stepper(const Scene& scene, double duration, Run& run);

/// Simulates an engine's run.
void simulate_engine(const Scene& scene, const FrameClock& clock, const QuantityChoice& choice,
                     Stepper& stepper, Run& run, Tally& tally);

/// Takes a run's poses from a log. Throws Error where it ends before the film does.
void take_frames(const Scene& scene, const PoseLog& log, const FrameClock& clock,
                 const QuantityChoice& choice, Run& run);

/// Reads at all kept steps the quantities that follow from the poses alone.
void read_poses(const Scene& scene, const QuantityChoice& choice, Run& run);

/// Turns a run's values at kept steps into values at frames, `interval` s apart, and sets its RMS error.
/// Positions and numbers are interpolated linearly, orientations by slerp; contacts are those of the later
/// step. Speeds that were not read follow from the poses of neighbouring frames.
void spread(const FrameClock& clock, double interval, const QuantityChoice& choice, Run& run);

/// Turns the reference's values at kept steps into values at frames.
void spread(const FrameClock& clock, ReferenceRun& reference);

/// One of the two runs of the reference.
struct ReferenceAttempt {
  std::vector<std::vector<Coordinates>> poses;
  double ended = infinity;     ///< time of its early end, s; infinite: it did not end early
  double unsolved = infinity;  ///< time of the first unsolved step, s; infinite: there is none
  int unsolved_steps = 0;

  bool is_whole(const FrameClock& clock) const {
    return unsolved_steps == 0 && poses.size() == clock.steps.size();
  }
};

/// Returns whether the scene's forces are smooth, so that the reference integrator can run it.
bool has_smooth_reference(const Scene& scene, double step);

/// Returns whether two refinements agree within 1e-9 of the scene's size: smaller steps would show nothing
/// new.
bool is_settled(const Scene& scene, const std::vector<Coordinates>& one,
                const std::vector<Coordinates>& other);

/// Simulates one of the two runs, with steps of `step` / `divisions`, or takes it from the cache.
/// `is_smooth` selects the reference integrator, else A1. A1 stops at the first frame that differs from
/// `like`'s; such a run is not cached.
ReferenceAttempt simulate_reference(const Scene& scene, const FrameClock& clock, double step, int divisions,
                                    bool is_smooth, const ReferenceCache& cache, Tally& tally,
                                    const ReferenceAttempt* like = nullptr);

/// Returns the finer run as reference, up to the time at which the two runs are apart by 1 % of the scene's
/// size. `times`: of the kept steps, s.
ReferenceRun reference_of(const Scene& scene, const ReferenceAttempt& coarse, ReferenceAttempt fine,
                          const std::vector<double>& times, const std::string& method);

}  // namespace substep::render
