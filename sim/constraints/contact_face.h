#pragma once
/// Manifolds of one normal, as two faces have. All their rows see of the velocities is how the bodies move
/// relative to each other at one point: six numbers, where four points have twelve rows. So a sweep reads
/// them once, solves all points from them and gives the bodies one force and one torque.
///
/// Normals' rows are those of ContactRow to rounding. Friction acts at the height of the deepest point: those
/// that touch have it.

#include "sim/constraints/lanes.h"

namespace substep {

/// Of a at a manifold's centre, relative to b. Components are along the normal and the tangents.
struct RelativeMotion {
  LaneVectors linear;
  LaneVectors angular;
};

/// What a gets at the centre, and b the opposite of. Components as above.
struct Wrench {
  LaneVectors force;
  LaneVectors torque;
};

[[gnu::always_inline]] inline LaneVectors along(const LaneVectors (&axes)[3], const LaneVectors& v) {
  return {{dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)}};
}

/// The vector that has these components.
[[gnu::always_inline]] inline LaneVectors composed(const LaneVectors (&axes)[3], const LaneVectors& of) {
  LaneVectors result;
  for (int k = 0; k < 3; ++k) {
    result[k] = axes[0][k] * of[0] + axes[1][k] * of[1] + axes[2][k] * of[2];
  }
  return result;
}

[[gnu::always_inline]] inline RelativeMotion relative_motion(const ContactFace& face, const Moving& a,
                                                             const Moving& b) {
  const LaneVectors linear = along(face.in_world, difference(a.linear, b.linear));
  const LaneVectors turn_a = along(face.in_a, a.angular);
  const LaneVectors turn_b = along(face.in_b, b.angular);
  const LaneVectors by_a = cross(turn_a, face.arm_a);
  const LaneVectors by_b = cross(turn_b, face.arm_b);
  return {
      {{linear[0] + (by_a[0] - by_b[0]), linear[1] + (by_a[1] - by_b[1]), linear[2] + (by_a[2] - by_b[2])}},
      difference(turn_a, turn_b)};
}

/// The torque about the centre of mass, as the rows see the body.
[[gnu::always_inline]] inline LaneVectors torque_on(const LaneVectors (&axes)[3], const LaneVectors& arm,
                                                    const Wrench& wrench) {
  const LaneVectors by_force = cross(arm, wrench.force);
  return composed(axes, {{wrench.torque[0] + by_force[0], wrench.torque[1] + by_force[1],
                          wrench.torque[2] + by_force[2]}});
}

/// v ← v + M⁻¹ (force, torques), as the rows see the bodies. `inertia` is null where rows are in the bodies'
/// frames.
[[gnu::always_inline]] inline void push(const ContactBatch& x, const FaceInertias* inertia,
                                        const LaneVectors& force, const LaneVectors& torque_a,
                                        const LaneVectors& torque_b, Moving& a, Moving& b) {
  const LaneVectors turn_a =
      inertia ? composed(inertia->a, torque_a) : product(x.inverse_inertia_a, torque_a);
  const LaneVectors turn_b =
      inertia ? composed(inertia->b, torque_b) : product(x.inverse_inertia_b, torque_b);
  for (int k = 0; k < 3; ++k) {
    a.linear[k] += x.inverse_mass_a * force[k];
    b.linear[k] -= x.inverse_mass_b * force[k];
    a.angular[k] += turn_a[k];
    b.angular[k] -= turn_b[k];
  }
}

/// v ← v + M⁻¹Jᵀ wrench.
[[gnu::always_inline]] inline void give(const ContactBatch& x, const ContactFace& face,
                                        const FaceInertias* inertia, const Wrench& wrench, Moving& a,
                                        Moving& b) {
  push(x, inertia, composed(face.in_world, wrench.force), torque_on(face.in_a, face.arm_a, wrench),
       torque_on(face.in_b, face.arm_b, wrench), a, b);
}

}  // namespace substep
