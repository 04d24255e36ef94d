#pragma once
/// Computes J̆' v̆, the second derivative of a row's C without acceleration: in closed form for locks, by
/// differences for limits. Internal to the reference integrator.

#include <vector>

#include "sim/algorithms.h"

namespace substep {

class JacobianRate {
 public:
  /// Prepares the rows of `rigid`, a model with locks and two-sided limits alone. `size`: size of the scene,
  /// m.
  JacobianRate(const Model& rigid, double size);
  JacobianRate(const JacobianRate&) = delete;
  JacobianRate& operator=(const JacobianRate&) = delete;

  /// Must be called after the rows of `rigid` changed.
  void set_up(const Problem& rigid);

  /// J̆' v̆ of each row; `rigid` is formulated at q.
  const std::vector<double>& terms(const Problem& rigid, const CoordinateVector& q, const VelocityVector& v);

 private:
  double size_;
  std::vector<Contact> no_contacts_;
  Model limit_model_;  // the rigid limits by themselves
  Problem limit_;
  std::vector<Vector3> lock_terms_;
  std::vector<double> limit_terms_;
  std::vector<double> terms_;  // by row
  CoordinateVector shifted_;
};

}  // namespace substep
