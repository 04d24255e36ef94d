#pragma once
/// The benchmark's scenes, and the judgement of their runs.

#include <string>
#include <vector>

#include "sim/measure/stepper.h"

namespace substep::benchmark {

struct BenchmarkScene {
  enum class Judge {
    trajectory,  ///< positions against the reference
    standing,    ///< nothing moves
    contained,   ///< nothing leaves the container
  };
  std::string name;
  Scene scene;
  double step;  ///< s
  int steps;    ///< of one run
  Judge judge;

  /// Returns true where there are no words, or the name begins with one of them.
  bool is_chosen_by(const std::vector<std::string>& words) const;
};

BenchmarkScene pendulum();          ///< a bar of 1 × 0.05 × 0.05 m, hung at its end, released level
BenchmarkScene chain_of(int rods);  ///< of 0.5 m and 1 kg, released level
/// side² balls on ball joints to their neighbours, hung at every fourth of an edge.
BenchmarkScene net_of(int side);
BenchmarkScene heavy_chain();  ///< ten rods and a ball of 1000 kg, at 480 Hz: explicit joints need it
BenchmarkScene stack_of(int boxes, double top_mass = 1);  ///< unit cubes of 1 kg, the top one of another
BenchmarkScene pyramid_of(int base);                      ///< base (base + 1)/2 unit cubes, pitch 1.1 m
BenchmarkScene wall_of(int side);   ///< side² unit cubes that touch, each row shifted by 0.15 m
BenchmarkScene pile_of(int boxes);  ///< boxes that fall into a container for 8 s

/// The judgement of a run: whether its error is small enough for a timed run.
struct Verdict {
  bool passed;
  double error;  ///< m: distance from the reference after 1 s, displacement, or way out of the container
};
/// Returns the state that a run should end with: that of A1 at step zero after 1 s, or the start.
State target_of(const BenchmarkScene& scene);
/// Runs the scene with `engine` from its start, for 1 s (trajectory) or for all its steps.
Verdict judge(const BenchmarkScene& scene, const State& target, Stepper& engine);

}  // namespace substep::benchmark
