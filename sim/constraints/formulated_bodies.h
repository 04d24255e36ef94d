#pragma once
/// Types that the formulations of points and patches share (contact_formulation.cpp).

#include <vector>

#include "sim/constraints/lanes.h"

namespace substep {

/// The data that a step's rows are formulated from.
struct Formulation {
  const std::vector<Contact>& contacts;
  const std::vector<Coordinates>& q;
  const std::vector<Matrix3>& rotations;
  double hs;
  bool anew;  ///< not for the first time in the step
  const std::vector<Matrix3>& first_rotations;
};

/// The bodies' part of a batch's formulation.
struct BatchBodies {
  LaneMatrices rotation_a;
  LaneMatrices rotation_b;
  LaneVectors offset;  ///< from b's centre of mass to a's
  Lanes inverse_mass;  ///< both bodies'
};

[[gnu::always_inline]] inline BatchBodies bodies_of(const ContactBatch& x, const Formulation& from) {
  const auto& q = from.q;
  BatchBodies at;
  at.rotation_a = gather_rotations(from.rotations, x.a);
  at.rotation_b = gather_rotations(from.rotations, x.b);
  const LaneVectors to_a = gather(q[x.a[0]].linear, q[x.a[1]].linear, q[x.a[2]].linear, q[x.a[3]].linear);
  const LaneVectors to_b = gather(q[x.b[0]].linear, q[x.b[1]].linear, q[x.b[2]].linear, q[x.b[3]].linear);
  at.offset = {{to_a[0] - to_b[0], to_a[1] - to_b[1], to_a[2] - to_b[2]}};
  at.inverse_mass = x.inverse_mass_a + x.inverse_mass_b;
  return at;
}

}  // namespace substep
