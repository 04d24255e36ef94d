#pragma once
/// The interface of simulations that can be measured: a stepper moves the bodies of a scene from step to
/// step. Our algorithms and other physics engines implement it. Functions measure CPU times of its runs.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "sim/model/settings.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

class Stepper {
 public:
  virtual ~Stepper() = default;

  /// Advances by one step h. Returns false, and leaves the state as it was, where it would not stay finite.
  virtual bool step() = 0;

  /// Returns centres of mass, orientations of the body frames and world velocities, in the scene's order.
  virtual const State& state() const = 0;

  /// Returns the contacts of the last step; nothing where they are not known.
  virtual std::optional<std::vector<ContactImpulse>> contact_impulses() const { return std::nullopt; }

  /// Returns the number of rows solved so far; 0 where it is not known.
  virtual std::int64_t row_solves() const { return 0; }
};

/// Makes a stepper at the scene's start, with step `settings.step`. Throws Error that says why it cannot.
using MakeStepper = std::function<std::unique_ptr<Stepper>(const Scene& scene, const Settings& settings)>;

/// Makes a stepper that plays given states; step() returns false at the last.
std::unique_ptr<Stepper> recorded_stepper(std::vector<State> states);

/// Makes a stepper of `settings.algorithm`.
std::unique_ptr<Stepper> algorithm_stepper(const Scene& scene, const Settings& settings);

/// Makes a stepper of reference_integrator.cpp. `order` 4: the classical Runge–Kutta method; other even
/// orders up to 12: extrapolation. Throws Error where the scene has contacts, or starts with open joints.
///
/// Closed loops have redundant rows. Rows that are linearly dependent to 1e-6, in the metric of the masses
/// where a step begins, are left out of the step; the other rows imply them.
///
/// A step does not end at an event: it finds the events by bisection, and continues after each. step()
/// returns false also where a step has more than twenty events; the state is then that before the step.
std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order);

/// Returns the CPU time of this thread, s; other threads do not count.
double cpu_time();

/// Mean CPU times of one step of h, µs. The whole step is timed in undisturbed runs; s1, s2 and s4 are timed
/// alone at states along the run, and s3 is the rest.
struct StageTimes {
  double geometry = 0;     ///< s1: contacts
  double formulation = 0;  ///< s2: rows and biases
  double velocities = 0;   ///< s3: the solver, with its sub-steps
  double coordinates = 0;  ///< s4: stepping coordinates; in A3 n times, with the rows formulated again
};

struct RunTimes {
  double median = 0;    ///< CPU time of all steps of the scene's duration, s
  double smallest = 0;  ///< of the repetitions
  double largest = 0;
  int repetitions = 0;
  StageTimes stages;  ///< µs a step; all 0 for other engines
};

/// Runs `repetitions` times on this thread. A run that diverges is timed until then.
RunTimes time_run(const Scene& scene, const Settings& settings, int repetitions);

/// Times any stepper, without its stages.
RunTimes time_run(const Scene& scene, const Settings& settings, const MakeStepper& make, int repetitions);

}  // namespace substep
