#pragma once
/// Compares a run with what is known of its scene: values that hold for the whole duration, also where no
/// reference can follow single bodies any more.

#include <memory>
#include <string>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// One figure of a run beside what it should be.
struct ExpectedFigure {
  std::string name;
  std::string unit;
  Bound bound = Bound::equal;
  double expected = 0;
  double tolerance = 0;  ///< an error beyond it is bad
  double measured = 0;   ///< infinite where the run ended first, or what was to happen never did

  /// In `unit`; infinite where nothing was measured.
  double error() const { return error_of(bound, expected, measured); }
  bool is_bad() const { return !(error() <= tolerance); }
};

/// Sees the states of one run. What it keeps does not grow with the run.
class ExpectationMeter {
 public:
  /// Of the scene's expectations those count that a run of `scene.duration` seconds can meet.
  ExpectationMeter(const Scene& scene, const State& start);
  ~ExpectationMeter();
  ExpectationMeter(const ExpectationMeter&) = delete;
  ExpectationMeter& operator=(const ExpectationMeter&) = delete;

  /// The state after a step, at `time` in s: times must increase.
  void add(const State& state, double time);

  /// In the scene's order. `diverged`: the run ended before its time.
  std::vector<ExpectedFigure> figures(bool diverged) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace substep
