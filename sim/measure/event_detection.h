#pragma once
/// Finds events: a rigid one-sided limit closes or opens, or a drive reaches or leaves its greatest force.
/// Between events the motion is smooth. Internal to the reference integrator.

#include <vector>

#include "sim/measure/constrained_dynamics.h"

namespace substep {

class EventDetection {
 public:
  /// Tells `dynamics` which limits are closed, and which drives are at their greatest force. At first all
  /// limits are open.
  EventDetection(const Model& model, ConstrainedDynamics& dynamics);
  EventDetection(const EventDetection&) = delete;
  EventDetection& operator=(const EventDetection&) = delete;

  /// Sets the drives for the start, and closes bounds that the start is at and that push, as a taut rope
  /// does.
  void start(const CoordinateVector& q, const VelocityVector& v);

  /// Returns true where a drive reaches or leaves its greatest force, or a bound closes or opens.
  bool detect_events(const CoordinateVector& q, const VelocityVector& v);

  /// Closes and opens bounds by the events at q and v̆, then projects both.
  void apply_events(CoordinateVector& q, VelocityVector& v);

 private:
  /// A rigid one-sided limit, which is a two-sided row while it is closed and pushes.
  struct Bound {
    Limit limit;
    bool held;
    double margin = 0;
  };

  /// Makes rows for the closed bounds.
  void set_up();
  void hold_bounds_met_at_the_start(const CoordinateVector& q, const VelocityVector& v);
  /// Updates the margin of each bound: the clearance of an open one (m, rad), the force of a closed one (N,
  /// N·m).
  void update_margins(const CoordinateVector& q, const VelocityVector& v);

  ConstrainedDynamics& dynamics_;
  std::vector<Bound> bounds_;
  std::vector<Contact> no_contacts_;
  Model open_model_;
  Problem open_;
};

}  // namespace substep
