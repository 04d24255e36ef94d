#pragma once
/// The motion of all bodies at equal intervals, the reference of runs, and its uncertainty.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep {

struct Motion {
  double interval = 0;         ///< s
  std::vector<State> samples;  ///< at 0, interval, 2 interval, …; fewer where the run diverged
};

/// Steps, `steps` times from sample to sample, until the motion has `samples` samples after the start or the
/// stepper cannot continue.
void continue_motion(Stepper& stepper, int steps, std::size_t samples, Motion& motion);

/// The instants that a run with step h and a motion with samples at each interval have in common. Throws
/// Error when h is neither a divisor nor a multiple of the interval.
struct Sampling {
  Sampling(double step, double interval);

  int steps_between = 1;    ///< steps from one common instant to the next
  int samples_between = 1;  ///< intervals from one common instant to the next
};

/// Returns the scene's size, by which errors are divided: the diameter of a ball about the moving bodies at
/// the start, m. A body counts as the box that has its moments of inertia.
double size_of(const Scene& scene);

/// Returns the diagonal of the smallest body that moves, m; a body counts as in size_of().
double smallest_body_of(const Scene& scene);

/// The root mean square and the largest value over bodies that can move (and over time).
struct Spread {
  double rms = 0;
  double largest = 0;
};

/// Collects values and returns their spread.
class SpreadMeter {
 public:
  void add(double value) {
    squares_ += value * value;
    largest_ = std::max(largest_, value);
    ++count_;
  }
  bool is_empty() const { return count_ == 0; }
  Spread result() const { return {is_empty() ? 0 : std::sqrt(squares_ / count_), largest_}; }

 private:
  double squares_ = 0;
  double largest_ = 0;
  int count_ = 0;
};

struct MotionDifference {
  Spread position;     ///< of centres of mass, m
  Spread orientation;  ///< rad
};

/// Returns the difference from sample 1 to `horizon` seconds. Infinite where there are no samples, or one of
/// the motions has ended.
MotionDifference difference(const Scene& scene, const Motion& a, const Motion& b, double horizon);

/// The largest error of any body until a sample.
struct Uncertainty {
  double position = 0;  ///< m
  double turn = 0;      ///< rad
};

struct ReferenceMotion {
  Motion motion;
  /// "own of order 12 at h/8", or "A1 of order 4 at h/128" (extrapolated from coarser steps); of a scene
  /// without contacts, A1's has the reason why the own integrator was not used.
  std::string method;
  double horizon = 0;            ///< s: the positions of single bodies are not known after it
  std::string divergence_point;  ///< the body that differs most just after `horizon`; empty: none
  std::vector<Uncertainty> uncertainties = {};  ///< by sample until the horizon

  /// Returns the uncertainty of any body before the horizon: by how much refinements moved it.
  Uncertainty uncertainty() const { return uncertainties.empty() ? Uncertainty{} : uncertainties.back(); }
};

/// Computes the motion without a step's error. Scenes without contacts: by the reference DAE integrator of
/// reference_integrator.cpp in order 12, with steps halved until no digit changes: down to 1/64 of the
/// scene's step, and for stiff springs as far as a few seconds of computing allow. Where that fails or does
/// not agree until `duration`: also by A1 at halved steps, extrapolated to step zero (Romberg's table) by the
/// column in which two refinements agree longest: a high one for a smooth motion, the first where contacts
/// open and close. Returns the motion with the later horizon: the time at which two refinements differ by
/// 2e-5 of the scene's size, at most `duration`. The motion may continue beyond it. A1's refinements run on
/// `threads` threads; the result is the same for any number.
ReferenceMotion reference_motion(const Scene& scene, double duration, int threads = 1);

/// Throws Error where the scene's duration or the horizon is shorter than a step, or the duration longer than
/// an hour.
void check_durations(const Scene& scene, double horizon);

}  // namespace substep
