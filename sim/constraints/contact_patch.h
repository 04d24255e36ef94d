#pragma once
/// Contact patches: the contacts of two flat faces as one block.
///
/// A patch is a manifold whose points lie in one plane and share one normal. Its normals' impulses are one
/// wrench at the points' centre: a force along the normal and torques about the tangents. Its friction is one
/// block of three: two tangents and the twist about the normal. README.md describes the cone of the normals
/// and both laws of friction. A patch that begins to slide remains on the ellipsoid for the step.

#include <optional>

#include "sim/constraints/lanes.h"

namespace substep {

/// Returns the shape of a manifold of `count` contacts with common directions. Returns nothing where the
/// manifold has an impact, a surface that rolls, a point outside the plane of the others, or no friction.
std::optional<PatchShape> patch_shape(const Contact* contacts, int count, const Coordinates& a,
                                      const Coordinates& b);

/// Velocity of a at a patch's centre, relative to b, along the axes.
struct RelativeMotion {
  LaneVectors linear;
  LaneVectors angular;
};

SUBSTEP_KERNEL LaneVectors along(const LaneVectors (&axes)[3], const LaneVectors& v) {
  return {{dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)}};
}

/// Returns the vector that has these components along the axes.
SUBSTEP_KERNEL LaneVectors composed(const LaneVectors (&axes)[3], const LaneVectors& of) {
  LaneVectors result;
  for (int k = 0; k < 3; ++k) {
    result[k] = axes[0][k] * of[0] + axes[1][k] * of[1] + axes[2][k] * of[2];
  }
  return result;
}

/// Returns the product of a symmetric matrix (11, 12, 13, 22, 23, 33) and a vector.
SUBSTEP_KERNEL LaneVectors symmetric_product(const Lanes (&m)[6], const LaneVectors& v) {
  return {{m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
           m[2] * v[0] + m[4] * v[1] + m[5] * v[2]}};
}

/// Returns J v of all six rows.
SUBSTEP_KERNEL RelativeMotion relative_motion(const Patch& patch, const BodyVelocities& a,
                                              const BodyVelocities& b) {
  const LaneVectors linear = along(patch.in_world, a.linear - b.linear);
  const LaneVectors turn_a = along(patch.in_a, a.angular);
  const LaneVectors turn_b = along(patch.in_b, b.angular);
  return {linear + (cross(turn_a, patch.arm_a) - cross(turn_b, patch.arm_b)), turn_a - turn_b};
}

/// Returns the components of a motion that normals act on.
SUBSTEP_KERNEL LaneVectors of_normals(const RelativeMotion& motion) {
  return {{motion.linear[0], motion.angular[1], motion.angular[2]}};
}

/// Returns the components of a motion that friction acts on.
SUBSTEP_KERNEL LaneVectors of_friction(const RelativeMotion& motion) {
  return {{motion.linear[1], motion.linear[2], motion.angular[0]}};
}

/// Applies v ← v + M⁻¹Jᵀ (normals, friction).
SUBSTEP_KERNEL void give(const ContactBatch& x, const Patch& patch, const LaneVectors& normals,
                         const LaneVectors& friction, BodyVelocities& a, BodyVelocities& b) {
  const LaneVectors force{{normals[0], friction[0], friction[1]}};
  const LaneVectors torque{{friction[2], normals[1], normals[2]}};
  const LaneVectors push = composed(patch.in_world, force);
  const LaneVectors turn_a = composed(patch.in_a, cross(patch.arm_a, force) + torque);
  const LaneVectors turn_b = composed(patch.in_b, cross(patch.arm_b, force) + torque);
  for (int k = 0; k < 3; ++k) {
    a.linear[k] += x.inverse_mass_a * push[k];
    b.linear[k] -= x.inverse_mass_b * push[k];
    a.angular[k] += x.inverse_inertia_a[k] * turn_a[k];
    b.angular[k] -= x.inverse_inertia_b[k] * turn_b[k];
  }
}

}  // namespace substep
