#pragma once
/// Compares a run with its scene's known figures, which hold also after the reference's horizon.

#include <functional>
#include <string>
#include <vector>

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// A figure of a run, and its expected value.
struct ExpectedFigure {
  std::string name;
  std::string unit;
  Bound bound = Bound::equal;
  double expected = 0;
  double tolerance = 0;  ///< an error beyond it is bad
  double measured = 0;   ///< infinite where the run ended first, or the event never happened

  /// Returns the error in `unit`; infinite where nothing was measured.
  double error() const { return error_of(bound, expected, measured); }
  bool is_bad() const { return !(error() <= tolerance); }
};

/// Measures the expected figures of one run, in constant memory.
class ExpectationMeter {
 public:
  /// Expectations later than `scene.duration` are left out.
  ExpectationMeter(const Scene& scene, const State& start);
  ~ExpectationMeter();
  ExpectationMeter(const ExpectationMeter&) = delete;
  ExpectationMeter& operator=(const ExpectationMeter&) = delete;

  /// Returns true where add() needs the contacts of each step.
  bool needs_contacts() const;

  /// Adds the state after a step, at a later `time` in s, and the step's contacts where they are known.
  void add(const State& state, double time, const std::vector<ContactImpulse>* contacts = nullptr);

  /// Returns the figures in the scene's order. `diverged`: the run ended early.
  std::vector<ExpectedFigure> figures(bool diverged) const;

 private:
  struct Figure;

  State start_;
  std::vector<Figure> figures_;
};

/// Returns "≤ 2" where 2 is the most that is expected, "≥ 2" where it is the least, else "2".
std::string bounded_text(Bound bound, const std::string& value);

/// Returns the first expectation of the scene whose quantity follows from poses; null where there is none.
const Expectation* expectation_of_poses(const Scene& scene);

/// Reads a number off poses.
using PoseReader = std::function<double(const std::vector<Coordinates>&)>;

/// Returns a reader of the expectation's quantity; of several bodies it returns the value furthest from the
/// expected one. The reader counts whole turns, so it must receive the poses of every step in turn.
PoseReader reader_of(const Scene& scene, const Expectation& expectation);

}  // namespace substep
