#pragma once
/// The kernel of patches, part of contact_solve.cpp: the normals' wrench in its cone, then the friction as
/// one block.

#include <algorithm>

#include "sim/constraints/contact_patch.h"

namespace substep {

/// Moves wrenches outside of their patch's cone to the nearest wrench in the cone, in the metric of Γ: on a
/// plane, else on a ray, else to 0.
template <int known>
SUBSTEP_KERNEL void move_into_cone(int count, const PatchCorner* corners, LaneVectors& wrench) {
  if constexpr (known) count = known;
  const Lanes zero = all(0);
  constexpr double rounding = 1e-10;
  Lanes beyond[known ? known : most_in_manifold];
  beyond[0] = dot(corners[0].plane, wrench);
  auto open = beyond[0] < zero;
  for (int k = 1; k < count; ++k) {
    beyond[k] = dot(corners[k].plane, wrench);
    open = open | (beyond[k] < zero);
  }
  if (!any(open)) return;
  LaneVectors nearest = wrench;
  // Try the planes that the wrench is behind: the right one's projection is inside of all others.
  for (int k = 0; k < count; ++k) {
    const LaneVectors& back = corners[k].to_plane;
    const LaneVectors on_plane = wrench - beyond[k] * back;
    auto is_inside = open & (beyond[k] < zero);
    const Lanes limit = all(rounding) * beyond[k];
    for (int j = 0; j < count; ++j) {
      if (j != k) is_inside = is_inside & (dot(corners[j].plane, on_plane) >= limit);
    }
    nearest = choose(is_inside, on_plane, nearest);
    open = open & ~is_inside;
  }
  // Else take the ray that comes nearest, or no impulse.
  if (any(open)) {
    Lanes most = zero;
    LaneVectors on_ray{{zero, zero, zero}};
    for (int k = 0; k < count; ++k) {
      const PatchCorner& corner = corners[k];
      const Lanes size = larger(dot(corner.to_ray, wrench), zero);
      const Lanes gain = size * size * corner.gamma;
      const auto is_better = gain > most;
      most = choose(is_better, gain, most);
      on_ray[0] = choose(is_better, size, on_ray[0]);
      on_ray[1] = choose(is_better, size * corner.position[1], on_ray[1]);
      on_ray[2] = choose(is_better, -(size * corner.position[0]), on_ray[2]);
    }
    nearest = choose(open, on_ray, nearest);
  }
  wrench = nearest;
}

/// Returns by how much a block's impulses move the velocity of one of its three rows at most, m/s or rad/s.
SUBSTEP_KERNEL Lanes largest_move(const LaneVectors& impulse, const Lanes (&gamma)[6]) {
  const Lanes first = larger(magnitude(impulse[0] * gamma[0]), magnitude(impulse[1] * gamma[3]));
  return larger(first, magnitude(impulse[2] * gamma[5]));
}

/// Solves the normals of a patch for the wrench in the cone that gives the velocities of β, or the nearest to
/// them. Returns the change of the wrench times the scale.
template <KernelKind kind, int known>
SUBSTEP_KERNEL LaneVectors solve_patch_normals(const KernelData& at, const PatchCorner* corners,
                                               const LaneVectors& velocity, Patch& patch, Lanes& most) {
  const int count = known ? known : at.x.corners;
  LaneVectors missing;
  for (int k = 0; k < 3; ++k) {
    missing[k] = times<kind>(at.how.tau, patch.normal_beta[k]) - times<kind>(at.how.kappa, velocity[k]);
  }
  // w = λ + ω Γ⁻¹ (τ β − κ J v)
  const LaneVectors change = symmetric_product(patch.normal_inverse, missing);
  LaneVectors wrench;
  for (int k = 0; k < 3; ++k) wrench[k] = patch.normal_impulse[k] + times<kind>(at.how.omega, change[k]);
  move_into_cone<known>(count, corners, wrench);
  const LaneVectors given = all(at.how.scale) * (wrench - patch.normal_impulse);
  for (int k = 0; k < 3; ++k) patch.normal_impulse[k] = wrench[k];
  if (kind == KernelKind::general) most = larger(most, largest_move(given, patch.normal_gamma));
  return given;
}

/// Fractions of a patch's normal force at its corners.
struct CornerFractions {
  Lanes of[most_corners];
};

/// Returns the fractions that have the normals' centre of pressure and vary linearly between the corners. No
/// fraction is negative.
SUBSTEP_KERNEL CornerFractions corner_fractions(int count, const PatchCorner* corners, const Patch& patch,
                                                const Lanes& normal) {
  const Lanes zero = all(0);
  const Lanes equal = all(1) / patch.corners;
  // Sum the corners' moments about their centre, without repeated corners.
  Lanes counts[most_corners];
  Lanes centre[2] = {zero, zero};
  for (int i = 0; i < count; ++i) {
    counts[i] = choose(patch.corners > all(i), all(1), zero);
    for (int k = 0; k < 2; ++k) centre[k] += counts[i] * equal * corners[i].position[k];
  }
  Lanes xx = zero;
  Lanes xy = zero;
  Lanes yy = zero;
  for (int i = 0; i < count; ++i) {
    const Lanes x = corners[i].position[0] - centre[0];
    const Lanes y = corners[i].position[1] - centre[1];
    xx += counts[i] * x * x;
    xy += counts[i] * x * y;
    yy += counts[i] * y * y;
  }
  // Corners on a line have moments along it alone.
  const Lanes least = all(1e-9) * (xx + yy);
  xx += least;
  yy += least;
  const Lanes inverse_normal = choose(normal > zero, all(1) / normal, zero);
  const Lanes x = -patch.normal_impulse[2] * inverse_normal - centre[0];
  const Lanes y = patch.normal_impulse[1] * inverse_normal - centre[1];
  const Lanes determinant = xx * yy - xy * xy;
  const Lanes by_x = (yy * x - xy * y) / determinant;
  const Lanes by_y = (xx * y - xy * x) / determinant;
  CornerFractions fractions;
  Lanes sum = zero;
  for (int i = 0; i < count; ++i) {
    const Lanes fraction =
        equal + by_x * (corners[i].position[0] - centre[0]) + by_y * (corners[i].position[1] - centre[1]);
    fractions.of[i] = counts[i] * larger(fraction, zero);
    sum += fractions.of[i];
  }
  for (int i = 0; i < count; ++i) fractions.of[i] = fractions.of[i] / sum;
  return fractions;
}

/// Sets the corners' friction to forces that add up to a wrench, where a patch has not slid: by fractions of
/// the wrench's force and of its torque about the centre of pressure.
SUBSTEP_KERNEL void distribute_friction(int count, PatchCorner* corners, const CornerFractions& fractions,
                                        const Lanes& slid, const LaneVectors& wrench) {
  const Lanes zero = all(0);
  Lanes centre[2] = {zero, zero};
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 2; ++k) centre[k] += fractions.of[i] * corners[i].position[k];
  }
  Lanes moment = zero;
  for (int i = 0; i < count; ++i) {
    const Lanes x = corners[i].position[0] - centre[0];
    const Lanes y = corners[i].position[1] - centre[1];
    moment += fractions.of[i] * (x * x + y * y);
  }
  const Lanes torque = wrench[2] - (centre[0] * wrench[1] - centre[1] * wrench[0]);
  const Lanes twist = choose(moment > zero, torque / moment, zero);
  for (int i = 0; i < count; ++i) {
    const Lanes force[2] = {fractions.of[i] * (wrench[0] - twist * (corners[i].position[1] - centre[1])),
                            fractions.of[i] * (wrench[1] + twist * (corners[i].position[0] - centre[0]))};
    for (int k = 0; k < 2; ++k) {
      corners[i].friction[k] = choose(slid > zero, corners[i].friction[k], force[k]);
    }
  }
}

/// Returns the friction of a patch that slides, a force of `limit` in all. The force at each corner is
/// opposite to the corner's slip. `missing`: target velocity less the slip, along the tangents and of the
/// twist.
SUBSTEP_KERNEL LaneVectors sliding_friction(int count, PatchCorner* corners, const Patch& patch,
                                            const CornerFractions& fractions, const Lanes& limit,
                                            const LaneVectors& missing) {
  // Bound Γ of all corners' forces. Two bodies that cannot turn have no twist.
  const Lanes radius = all(1) / patch.inverse_radius;
  const Lanes of_twist = choose(patch.inverse_twist > all(0), radius * radius / patch.inverse_twist, all(0));
  const Lanes gamma = patch.corners * larger(all(1) / patch.inverse_largest, of_twist);
  LaneVectors friction{{all(0), all(0), all(0)}};
  for (int i = 0; i < count; ++i) {
    PatchCorner& corner = corners[i];
    const Lanes& x = corner.position[0];
    const Lanes& y = corner.position[1];
    const Lanes along[2] = {gamma * corner.friction[0] + (missing[0] - missing[2] * y),
                            gamma * corner.friction[1] + (missing[1] + missing[2] * x)};
    const Lanes length = root(along[0] * along[0] + along[1] * along[1]);
    const Lanes factor = choose(length > all(0), fractions.of[i] * limit / length, all(0));
    for (int k = 0; k < 2; ++k) corner.friction[k] = factor * along[k];
    friction[0] += corner.friction[0];
    friction[1] += corner.friction[1];
    friction[2] += x * corner.friction[1] - y * corner.friction[0];
  }
  return friction;
}

/// Returns the friction of a patch that begins to slide: the projection of λ + (missing velocity)/γ on the
/// ellipsoid.
SUBSTEP_KERNEL LaneVectors begun_slide(const Patch& patch, const Lanes& limit, const LaneVectors& before,
                                       const LaneVectors& missing) {
  const LaneVectors target{{before[0] + missing[0] * patch.inverse_largest,
                            before[1] + missing[1] * patch.inverse_largest,
                            before[2] + missing[2] * patch.inverse_twist}};
  const Lanes twist = target[2] * patch.inverse_radius;
  const Lanes length = root(target[0] * target[0] + target[1] * target[1] + twist * twist);
  const Lanes factor = choose(length > all(0), limit / length, all(0));
  return factor * target;
}

/// Returns the friction of a patch that continues to slide, corner by corner. Friction brakes the slip to
/// zero at most, and does not reverse it.
SUBSTEP_KERNEL LaneVectors kept_slide(const KernelData& at, PatchCorner* corners, const Patch& patch,
                                      const Lanes& slid, const Lanes& limit, const LaneVectors& before,
                                      const LaneVectors& missing) {
  const Lanes normal = larger(patch.normal_impulse[0], all(0));
  const CornerFractions fractions = corner_fractions(at.x.corners, corners, patch, normal);
  distribute_friction(at.x.corners, corners, fractions, slid, before);
  const LaneVectors sliding = sliding_friction(at.x.corners, corners, patch, fractions, limit, missing);
  const LaneVectors response = symmetric_product(patch.gamma, sliding);
  const Lanes stopping = dot(sliding, missing) + dot(response, before);
  const Lanes full = dot(sliding, response);
  const Lanes part = choose(stopping < full, larger(stopping, all(0)) / full, all(1));
  return part * sliding;
}

/// Solves the friction of a patch, two tangents and the twist as one block. The patch holds inside of an
/// ellipsoid, else it slides, from the second step on by Coulomb's law at the corners. Returns the change of
/// the impulses times the scale.
template <KernelKind kind>
SUBSTEP_KERNEL LaneVectors solve_patch_friction(const KernelData& at, PatchCorner* corners,
                                                const LaneVectors& slip, const LaneVectors& normals,
                                                Patch& patch, Lanes& most) {
  const Lanes normal = larger(patch.normal_impulse[0], all(0));  // rounding may leave less
  reduce_origin(patch, normal);
  const Lanes(&by)[9] = patch.by_normals;
  LaneVectors missing;
  LaneVectors before;
  for (int k = 0; k < 3; ++k) {
    const Lanes velocity =
        slip[k] + (by[3 * k] * normals[0] + by[3 * k + 1] * normals[1] + by[3 * k + 2] * normals[2]);
    missing[k] = times<kind>(at.how.omega,
                             times<kind>(at.how.tau, patch.beta[k]) - times<kind>(at.how.kappa, velocity));
    before[k] = patch.impulse[k] - patch.origin[k];
  }
  // Where it holds: λ + ω Γ⁻¹ (τ β − κ J v)
  LaneVectors total = symmetric_product(patch.inverse, missing) + before;
  const Lanes limit = patch.coefficient * (normal - patch.origin_normal);
  const Lanes twist = total[2] * patch.inverse_radius;
  const auto slides = total[0] * total[0] + total[1] * total[1] + twist * twist >= limit * limit;
  const Lanes slid = patch.slides;
  patch.slides = choose(slides, all(1), all(0));
  if (any(slides)) [[unlikely]] {
    total = choose(slides, begun_slide(patch, limit, before, missing), total);
    const auto continues = slides & (patch.slid > all(0));
    if (any(continues)) {
      total = choose(continues, kept_slide(at, corners, patch, slid, limit, before, missing), total);
    }
  }
  const LaneVectors given = all(at.how.scale) * (total - before);
  for (int k = 0; k < 3; ++k) patch.impulse[k] = total[k] + patch.origin[k];
  if (kind == KernelKind::general) most = larger(most, largest_move(given, patch.gamma));
  return given;
}

/// Solves four patches. Returns true if any continues to slide.
template <KernelKind kind, int known>
SUBSTEP_KERNEL bool solve_patch(const KernelData& at, PatchCorner* corners, Patch& patch,
                                std::vector<Velocity>& v, double* moved) {
  Lanes most = all(0);
  BodyVelocities a = gather(v, at.x.a);
  BodyVelocities b = gather(v, at.x.b);
  const RelativeMotion motion = relative_motion(patch, a, b);
  const LaneVectors normals = solve_patch_normals<kind, known>(at, corners, of_normals(motion), patch, most);
  const LaneVectors friction =
      solve_patch_friction<kind>(at, corners, of_friction(motion), normals, patch, most);
  give(at.x, patch, normals, friction, a, b);
  scatter(a, at.x.a, at.x.manifolds, v);
  scatter(b, at.x.b, at.x.manifolds, v);
  raise_to_largest<kind>(most, moved);
  return any(keeps_sliding(patch) > all(0));
}

}  // namespace substep
