#pragma once
/// Formulates the rows of contact patches (s2, formulate.h). Only contact_formulation.cpp includes it.

#include <algorithm>

#include "sim/constraints/contact_patch.h"

namespace substep {

/// Γ of a patch: the change of the velocity at its centre by an impulsive wrench there. 3×3 matrices by rows,
/// along the patch's axes: normal, tangents.
struct PatchGamma {
  Lanes linear_by_force[9];
  Lanes linear_by_torque[9];  ///< transpose: change of spin by a force
  Lanes spin_by_torque[9];
};

/// Adds a body's contribution to Γ. `axes`: the patch's, `arm`: along them, both of this body.
SUBSTEP_KERNEL void add_body(const LaneVectors (&axes)[3], const LaneVectors& arm, const Lanes& inverse_mass,
                             const LaneVectors& inverse_inertia, PatchGamma& gamma) {
  Lanes m[9];
  for (int i = 0; i < 3; ++i) {
    const LaneVectors response = product(inverse_inertia, axes[i]);
    for (int j = i; j < 3; ++j) m[3 * i + j] = m[3 * j + i] = dot(response, axes[j]);
  }
  Lanes k[9];
  for (int j = 0; j < 3; ++j) {
    k[j] = m[3 + j] * arm[2] - m[6 + j] * arm[1];
    k[3 + j] = m[6 + j] * arm[0] - m[j] * arm[2];
    k[6 + j] = m[j] * arm[1] - m[3 + j] * arm[0];
  }
  for (int i = 0; i < 3; ++i) {
    gamma.linear_by_force[3 * i] += k[3 * i + 1] * arm[2] - k[3 * i + 2] * arm[1];
    gamma.linear_by_force[3 * i + 1] += k[3 * i + 2] * arm[0] - k[3 * i] * arm[2];
    gamma.linear_by_force[3 * i + 2] += k[3 * i] * arm[1] - k[3 * i + 1] * arm[0];
    gamma.linear_by_force[4 * i] += inverse_mass;
  }
  for (int i = 0; i < 9; ++i) {
    gamma.linear_by_torque[i] += k[i];
    gamma.spin_by_torque[i] += m[i];
  }
}

/// Inverts a symmetric matrix (11, 12, 13, 22, 23, 33). The inverse of a singular one is 0.
SUBSTEP_KERNEL void invert(const Lanes (&s)[6], Lanes (&inverse)[6]) {
  inverse[0] = s[3] * s[5] - s[4] * s[4];
  inverse[1] = s[2] * s[4] - s[1] * s[5];
  inverse[2] = s[1] * s[4] - s[2] * s[3];
  inverse[3] = s[0] * s[5] - s[2] * s[2];
  inverse[4] = s[1] * s[2] - s[0] * s[4];
  inverse[5] = s[0] * s[3] - s[1] * s[1];
  const Lanes factor = inverse_or_zero(s[0] * inverse[0] + s[1] * inverse[1] + s[2] * inverse[2]);
  for (Lanes& element : inverse) element *= factor;
}

/// Inverts Γ of normals whose points lie on a line, within the two dimensions of their wrenches: a force, and
/// a torque along `across`.
SUBSTEP_KERNEL void invert_on_line(const Lanes (&s)[6], const Lanes (&across)[2], Lanes (&inverse)[6]) {
  const Lanes c00 = s[0];
  const Lanes c01 = s[1] * across[0] + s[2] * across[1];
  const Lanes c11 =
      across[0] * across[0] * s[3] + all(2) * across[0] * across[1] * s[4] + across[1] * across[1] * s[5];
  const Lanes factor = inverse_or_zero(c00 * c11 - c01 * c01);
  const Lanes i00 = c11 * factor;
  const Lanes i01 = -c01 * factor;
  const Lanes i11 = c00 * factor;
  inverse[0] = i00;
  inverse[1] = i01 * across[0];
  inverse[2] = i01 * across[1];
  inverse[3] = i11 * across[0] * across[0];
  inverse[4] = i11 * across[0] * across[1];
  inverse[5] = i11 * across[1] * across[1];
}

/// Sets a patch's Γ, its inverses, and the coupling of friction and normals.
SUBSTEP_KERNEL void set_gamma(const ContactBatch& x, const Four<PatchShape>& from, Patch& patch) {
  const Lanes zero = all(0);
  PatchGamma gamma;
  for (int i = 0; i < 9; ++i)
    gamma.linear_by_force[i] = gamma.linear_by_torque[i] = gamma.spin_by_torque[i] = zero;
  add_body(patch.in_a, patch.arm_a, x.inverse_mass_a, x.inverse_inertia_a, gamma);
  add_body(patch.in_b, patch.arm_b, x.inverse_mass_b, x.inverse_inertia_b, gamma);
  // Split the wrench: normals have force 0 and torques 1 and 2, friction forces 1 and 2 and torque 0.
  const Lanes* const g = gamma.linear_by_force;
  const Lanes* const k = gamma.linear_by_torque;
  const Lanes* const m = gamma.spin_by_torque;
  const Lanes normal[6] = {g[0], k[1], k[2], m[4], m[5], m[8]};
  const Lanes friction[6] = {g[4], g[5], k[3], g[8], k[6], m[0]};
  const Lanes by_normals[9] = {g[3], k[4], k[5], g[6], k[7], k[8], k[0], m[1], m[2]};
  for (int i = 0; i < 6; ++i) patch.normal_gamma[i] = normal[i];
  for (int i = 0; i < 6; ++i) patch.gamma[i] = friction[i];
  for (int i = 0; i < 9; ++i) patch.by_normals[i] = by_normals[i];
  invert(patch.normal_gamma, patch.normal_inverse);
  const auto is_line = patch.corners == all(2);
  if (any(is_line)) {
    const auto side = [&](int axis) __attribute__((always_inline)) {
      return gather(from, [&](const PatchShape& s) { return s.corner[1][axis] - s.corner[0][axis]; });
    };
    const Lanes length = root(side(0) * side(0) + side(1) * side(1));
    const Lanes across[2] = {side(1) / length, -side(0) / length};
    Lanes on_line[6];
    invert_on_line(patch.normal_gamma, across, on_line);
    for (int i = 0; i < 6; ++i) {
      patch.normal_inverse[i] = choose(is_line, on_line[i], patch.normal_inverse[i]);
    }
  }
  invert(patch.gamma, patch.inverse);
  patch.inverse_largest = inverse_or_zero(larger_eigenvalue(friction[0], friction[1], friction[3]));
  patch.inverse_twist = inverse_or_zero(friction[5]);
}

/// Sets the planes and rays of the cone of wrenches that a patch's normals can exert.
SUBSTEP_KERNEL void set_corners(const ContactBatch& x, const Four<PatchShape>& from, const Patch& patch,
                                PatchCorner* corners) {
  const auto corner_at = [&](int i, int axis) __attribute__((always_inline)) {
    return gather(
        from, [&](const PatchShape& shape) { return shape.corner[std::min(i, shape.corners - 1)][axis]; });
  };
  const auto next = [&](int i, int axis) __attribute__((always_inline)) {
    return gather(
        from, [&](const PatchShape& shape) { return shape.corner[i + 1 < shape.corners ? i + 1 : 0][axis]; });
  };
  const Lanes squared_radius =
      gather(from, [](const PatchShape& shape) { return shape.radius * shape.radius; });
  for (int i = 0; i < x.corners; ++i) {
    PatchCorner& corner = corners[i];
    const Lanes here[2] = {corner_at(i, 0), corner_at(i, 1)};
    const Lanes along[2] = {next(i, 0) - here[0], next(i, 1) - here[1]};
    corner.position[0] = here[0];
    corner.position[1] = here[1];
    // Set the plane through the edge; the length of its normal does not matter.
    corner.plane = {{along[1] * here[0] - along[0] * here[1], along[0], along[1]}};
    // Bound a line at its end: the centre of pressure is on the side of the other end.
    const auto is_line = patch.corners == all(2);
    corner.plane[0] = choose(is_line, -(here[0] * along[0] + here[1] * along[1]), corner.plane[0]);
    corner.plane[1] = choose(is_line, along[1], corner.plane[1]);
    corner.plane[2] = choose(is_line, -along[0], corner.plane[2]);
    // Repeat the last corner of a patch with fewer: its plane only requires a force that pushes, in the unit
    // of the other planes.
    const auto is_beyond = patch.corners <= all(i);
    for (int k = 0; k < 3; ++k)
      corner.plane[k] = choose(is_beyond, k == 0 ? squared_radius : all(0), corner.plane[k]);
    const LaneVectors back = symmetric_product(patch.normal_inverse, corner.plane);
    const Lanes scale = inverse_or_zero(dot(corner.plane, back));
    const LaneVectors ray{{all(1), corner.position[1], -corner.position[0]}};
    const LaneVectors response = symmetric_product(patch.normal_gamma, ray);
    corner.gamma = dot(ray, response);
    const Lanes inverse_gamma = inverse_or_zero(corner.gamma);
    for (int k = 0; k < 3; ++k) {
      corner.to_plane[k] = back[k] * scale;
      corner.to_ray[k] = response[k] * inverse_gamma;
    }
  }
}

/// Sets a patch's impulses to 0, and its friction from its shape.
SUBSTEP_KERNEL void start_patch(const Four<PatchShape>& from, Patch& patch) {
  const Lanes zero = all(0);
  patch.normal_impulse = patch.impulse = patch.origin = {{zero, zero, zero}};
  patch.origin_normal = patch.slides = zero;
  patch.slid = gather(from, &PatchShape::slid);
  patch.coefficient = gather(from, &PatchShape::friction);
  patch.inverse_radius = all(1) / gather(from, &PatchShape::radius);
  patch.corners = gather(from, &PatchShape::corners);
  patch.reference = gather(from, &PatchShape::reference);
}

/// Formulates a batch of patches (s2): axes, arms, β and Γ.
SUBSTEP_KERNEL void formulate_patch(ContactBatches& contacts, const ContactBatch& x, const BatchBodies& at,
                                    const Formulation& from) {
  const PatchShape* const all_shapes = contacts.shapes.data();
  const Four<PatchShape> shapes{all_shapes + x.shape[0], all_shapes + x.shape[1], all_shapes + x.shape[2],
                                all_shapes + x.shape[3]};
  Patch& patch = contacts.patches[x.patch];
  if (from.substep == 0) start_patch(shapes, patch);
  // Set the axes, and the arms of the centre.
  const auto column = [&](Matrix3 PatchShape::*axes, int k) __attribute__((always_inline)) {
    return gather((shapes[0]->*axes).col(k), (shapes[1]->*axes).col(k), (shapes[2]->*axes).col(k),
                  (shapes[3]->*axes).col(k));
  };
  LaneVectors first_in_a[3];
  for (int k = 0; k < 3; ++k) {
    patch.in_b[k] = column(&PatchShape::axes_in_b, k);
    patch.in_world[k] = turned(at.rotation_b, patch.in_b[k]);
    patch.in_a[k] = turned_back(at.rotation_a, patch.in_world[k]);
    first_in_a[k] = column(&PatchShape::axes_in_a, k);
  }
  patch.arm_a = along(patch.in_a, gather(shapes, &PatchShape::arm_a));
  patch.arm_b = along(patch.in_b, gather(shapes, &PatchShape::arm_b));
  // Measure how the patch has opened, tilted and slipped.
  const LaneVectors offset = along(patch.in_world, at.offset);
  const LaneVectors apart = offset + patch.arm_a - patch.arm_b;
  const auto value = [&](auto member, int k) __attribute__((always_inline)) {
    return gather(shapes, [&](const PatchShape& shape) { return (shape.*member)[k]; });
  };
  const Lanes per_substep = all(-1) / all(from.hs);
  const Lanes tilt[2] = {
      value(&PatchShape::tilt, 0) + value(&PatchShape::left, 1) - dot(first_in_a[0], patch.in_a[1]),
      value(&PatchShape::tilt, 1) + value(&PatchShape::left, 2) - dot(first_in_a[0], patch.in_a[2])};
  patch.normal_beta = {{(apart[0] + value(&PatchShape::left, 0)) * per_substep, tilt[1] * per_substep,
                        -tilt[0] * per_substep}};
  const LaneVectors slip{{apart[1], apart[2], dot(first_in_a[1], patch.in_a[2])}};
  const auto is_released = keeps_sliding(patch) > all(0);
  for (int k = 0; k < 3; ++k) {
    patch.reference[k] = choose(is_released, -slip[k], patch.reference[k]);
    patch.beta[k] = (slip[k] + patch.reference[k]) * per_substep;
  }
  set_gamma(x, shapes, patch);
  set_corners(x, shapes, patch, contacts.patch_corners.data() + x.first_corner);
}

}  // namespace substep
