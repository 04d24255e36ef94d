#pragma once
/// The motion of all bodies at equal intervals, the reference that runs are measured against, and its own
/// uncertainty.

#include <limits>
#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep {

/// The error of what ended early or was never there.
inline constexpr double infinite = std::numeric_limits<double>::infinity();

struct Motion {
  double interval = 0;         ///< s
  std::vector<State> samples;  ///< at 0, interval, 2 interval, …; fewer than asked for when it diverged
};

/// The instants of the samples of a run with step h: whole numbers of steps and of intervals. Throws Error
/// when h is neither a divisor nor a multiple of the interval.
class Sampling {
 public:
  Sampling(double step, double interval);
  int steps_between() const { return steps_; }  ///< steps from one common instant to the next
  int samples_between() const { return samples_; }

 private:
  int steps_ = 1;
  int samples_ = 1;
};

/// Diameter of a ball about the bodies that move, as they stand at the start, m: what errors are divided by.
/// A body counts as the box that has its moments of inertia.
double size_of(const Scene& scene);

/// Diagonal of the smallest body that moves, m; a body counts as above.
double smallest_body_of(const Scene& scene);

/// Root of the mean square, and the largest, over bodies that can move (and over time).
struct Spread {
  double rms = 0;
  double largest = 0;
};

struct MotionDifference {
  Spread position;     ///< of centres of mass, m
  Spread orientation;  ///< rad
};

/// From sample 1 on to `horizon` seconds, at the instants that are `every` samples apart. Infinite where
/// there are none, or one of the motions has ended.
MotionDifference difference(const Scene& scene, const Motion& a, const Motion& b, double horizon,
                            int every = 1);

/// By how much any body may be off at any time until a sample.
struct Uncertainty {
  double position = 0;  ///< m
  double turn = 0;      ///< rad
};

struct ReferenceMotion {
  Motion motion;
  /// "own of order 12 at h/8"; "A1 of order 4 at h/128" (extrapolated from coarser steps), and where the
  /// scene has no contacts why it is not the first.
  std::string method;
  double uncertainty = 0;        ///< of any body before the horizon, m: what refinements moved it by
  double turn_uncertainty = 0;   ///< the same, rad
  double horizon = 0;            ///< s: after it the reference says nothing more of single bodies
  std::string divergence_point;  ///< the body of which two refinements then say different things; empty: none
  std::vector<Uncertainty> uncertainties = {};  ///< by sample until the horizon; the last are those above
};

/// The motion without a step's error. Where the scene has no contacts: by the reference DAE integrator of
/// reference_integrator.h, in order 12, with steps halved until no digit moves any more: down to 1/64 of the
/// scene's, and where that is too coarse for a stiff spring as far as a few seconds of computing allow. Else,
/// and where that lasts longer: A1 at steps halved again and again, extrapolated to step zero (Richardson;
/// Romberg's table). Of the table's columns the one is taken that two refinements agree on longest: a high
/// one where the motion is smooth, none where contacts open and close. The horizon is where two refinements
/// differ by 2e-5 of the scene's size, and at most `duration`; the motion may end with the next sample. A1's
/// refinements run on `threads` threads; the result is the same for any number.
ReferenceMotion reference_motion(const Scene& scene, double duration, int threads = 1);

}  // namespace substep
