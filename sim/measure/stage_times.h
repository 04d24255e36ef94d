#pragma once
/// CPU time of a run, and of the stages of its steps. Differs from run to run.

#include "sim/measure/stepper.h"

namespace substep {

/// Returns the CPU time of this thread, s; other threads do not count.
double cpu_time();

/// Mean CPU times of one step of h, µs. The whole step is timed in runs without anything in between; s1, s2
/// and s4 are repeated by themselves at states along the run, and s3 is what is left.
struct StageTimes {
  double geometry = 0;     ///< s1: contacts
  double formulation = 0;  ///< s2: rows and biases
  double velocities = 0;   ///< s3: the solver, with its sub-steps
  double coordinates = 0;  ///< s4: stepping coordinates; A3's n times, with its formulation of rows anew
};

struct RunTimes {
  double median = 0;    ///< CPU time of all steps of the scene's duration, s
  double smallest = 0;  ///< of the repetitions
  double largest = 0;
  int repetitions = 0;
  StageTimes stages;  ///< µs a step; all 0 for steppers that are not ours
};

/// Runs `repetitions` times on this thread. A run that diverges is timed until then.
RunTimes time_run(const Scene& scene, const Settings& settings, int repetitions);

/// Times any stepper, without its stages.
RunTimes time_run(const Scene& scene, const Settings& settings, const MakeStepper& make, int repetitions);

}  // namespace substep
