// s2 of contacts: computes rows, the origins of friction's limits and Γ from coordinates. Manifolds that are
// solved by points are here, patches in patch_formulation.h.

#include "sim/constraints/patch_formulation.h"

namespace substep {
namespace {

/// A direction that is fixed in b, in three frames.
struct Direction {
  LaneVectors in_b;
  LaneVectors in_world;
  LaneVectors in_a;
};

SUBSTEP_KERNEL void set_direction(const BatchBodies& at, const LaneVectors& in_b, Direction& direction) {
  // Copy component by component: gcc 12 copies the whole struct as bytes, which is slow.
  const LaneVectors in_world = turned(at.rotation_b, in_b);
  const LaneVectors in_a = turned_back(at.rotation_a, in_world);
  for (int k = 0; k < 3; ++k) {
    direction.in_b[k] = in_b[k];
    direction.in_world[k] = in_world[k];
    direction.in_a[k] = in_a[k];
  }
}

/// Sets the angular parts of a row's J. Returns the contact's distance along its direction.
SUBSTEP_KERNEL Lanes set_row(const BatchBodies& at, const PointArms& arms, const Direction& along,
                             ContactRow& row) {
  row.angular_a = cross(arms.a, along.in_a);
  row.angular_b = cross(along.in_b, arms.b);
  return dot(along.in_world, at.offset) + dot(along.in_a, arms.a) - dot(along.in_b, arms.b);
}

/// The angular parts of M⁻¹Jᵀ of a row.
struct RowResponses {
  LaneVectors a;
  LaneVectors b;
};

SUBSTEP_KERNEL RowResponses responses_of(const ContactBatch& x, const ContactRow& row) {
  return {product(x.inverse_inertia_a, row.angular_a), product(x.inverse_inertia_b, row.angular_b)};
}

/// Returns an element of Γ: `linear` is the product of both directions.
SUBSTEP_KERNEL Lanes coupling(const BatchBodies& at, const Lanes& linear, const ContactRow& one,
                              const RowResponses& other) {
  return linear * at.inverse_mass + dot(one.angular_a, other.a) + dot(one.angular_b, other.b);
}

/// Inverts Γ. Where Γ is singular to rounding, its trace replaces both diagonal elements.
SUBSTEP_KERNEL void invert(FrictionRows& rows) {
  const Lanes zero = all(0);
  const Lanes one = all(1);
  const Lanes trace = rows.gamma[0] + rows.gamma[2];
  const Lanes determinant = rows.gamma[0] * rows.gamma[2] - rows.gamma[1] * rows.gamma[1];
  const auto regular = determinant > all(1e-14) * trace * trace;
  rows.gamma[0] = choose(regular, rows.gamma[0], trace);
  rows.gamma[1] = choose(regular, rows.gamma[1], zero);
  rows.gamma[2] = choose(regular, rows.gamma[2], trace);
  rows.inverse_determinant =
      choose(regular, one / determinant, choose(trace > zero, one / (trace * trace), zero));
  rows.inverse_largest = inverse_or_zero(larger_eigenvalue(rows.gamma[0], rows.gamma[1], rows.gamma[2]));
}

/// Returns the ellipsoid's farthest point against a normal, which points out of the other surface, all in one
/// body's frame.
SUBSTEP_KERNEL LaneVectors lowest(const LaneMatrices& ellipsoid, const LaneVectors& centre,
                                  const LaneVectors& normal) {
  const LaneVectors reach = turned(ellipsoid, normal);
  // A circle across the normal has no lowest point.
  const Lanes distance = root(larger(dot(normal, reach), all(1e-24)));
  return centre - LaneVectors{{reach[0] / distance, reach[1] / distance, reach[2] / distance}};
}

/// Turns the directions, which are in b's frame, back to where they turn with a or with neither body since
/// the step's first formulation.
SUBSTEP_KERNEL void turn_back(const BatchBodies& at, const ContactBatch& x, const Four<Contact>& contact,
                              const Formulation& from, LaneVectors (&directions)[3]) {
  const auto with_a = gather(contact, &Contact::turns_with_a) > all(0);
  const auto with_neither = gather(contact, &Contact::turns_with_neither) > all(0);
  if (!any(with_a) && !any(with_neither)) return;
  const LaneMatrices first_a = gather(from.first_rotations, x.a);
  const LaneMatrices first_b = gather(from.first_rotations, x.b);
  for (LaneVectors& direction : directions) {
    const LaneVectors first = turned(first_b, direction);
    const LaneVectors turned_with_a =
        turned_back(at.rotation_b, turned(at.rotation_a, turned_back(first_a, first)));
    const LaneVectors fixed = turned_back(at.rotation_b, first);
    for (int k = 0; k < 3; ++k) {
      Lanes& component = direction[k];
      component = choose(with_a, turned_with_a[k], choose(with_neither, fixed[k], component));
    }
  }
}

/// Moves the points of round bodies that have turned in the step (A3) to where the normal meets their
/// surface. A point that is fixed in the body would roll away from the contact and push where nothing
/// touches.
SUBSTEP_KERNEL void roll(const Four<Contact>& contact, const Direction& normal, PointArms& arms) {
  const auto rolls_a = gather(contact, &Contact::rolls_a) > all(0);
  if (any(rolls_a)) {
    const LaneVectors arm =
        lowest(gather(contact, &Contact::ellipsoid_a), gather(contact, &Contact::centre_a), normal.in_a);
    for (int k = 0; k < 3; ++k) arms.a[k] = choose(rolls_a, arm[k], arms.a[k]);
  }
  const auto rolls_b = gather(contact, &Contact::rolls_b) > all(0);
  if (any(rolls_b)) {
    const LaneVectors arm = lowest(gather(contact, &Contact::ellipsoid_b),
                                   gather(contact, &Contact::centre_b), all(-1) * normal.in_b);
    for (int k = 0; k < 3; ++k) arms.b[k] = choose(rolls_b, arm[k], arms.b[k]);
  }
}

/// Moves the point of the body with which the normal turns (A3) along the surface to the other body's point,
/// as one slides on the other. With the arm of the start, the normal's turning would change the energy.
/// Points that have yet to meet keep their arms.
SUBSTEP_KERNEL void follow(const BatchBodies& at, const Four<Contact>& contact, const Direction& normal,
                           int substep, PointArms& arms) {
  const Lanes has_met = choose(gather(contact, &Contact::meets_in) < all(substep), all(1), all(0));
  const auto on_a = has_met * gather(contact, &Contact::turns_with_a) > all(0);
  const auto on_neither = gather(contact, &Contact::turns_with_neither) > all(0);
  const LaneVectors apart = at.offset + turned(at.rotation_a, arms.a) - turned(at.rotation_b, arms.b);
  const LaneVectors along = apart - dot(normal.in_world, apart) * normal.in_world;
  const LaneVectors along_a = turned_back(at.rotation_a, along);
  const LaneVectors along_b = turned_back(at.rotation_b, along);
  for (int k = 0; k < 3; ++k) {
    arms.a[k] = choose(on_a, arms.a[k] - along_a[k], arms.a[k]);
    arms.b[k] = choose(on_a, arms.b[k], choose(on_neither, arms.b[k], arms.b[k] + has_met * along_b[k]));
  }
}

/// Sets the directions of a contact point: the normal, then the tangents.
SUBSTEP_KERNEL void set_directions(const BatchBodies& at, const ContactBatch& x, const Four<Contact>& contact,
                                   const Formulation& from, Direction (&directions)[3],
                                   ContactDirections& in_world) {
  LaneVectors in_b[3] = {gather(contact, &Contact::normal_b), gather(contact, &Contact::tangent_b1),
                         gather(contact, &Contact::tangent_b2)};
  if (from.substep > 0) turn_back(at, x, contact, from, in_b);
  for (int k = 0; k < 3; ++k) set_direction(at, in_b[k], directions[k]);
  in_world.normal = directions[0].in_world;
  for (int k = 0; k < 2; ++k) in_world.tangent[k] = directions[1 + k].in_world;
}

SUBSTEP_KERNEL void start_restitution(const Four<Contact>& contact, RestitutionRow& row) {
  row.impact = all(0);
  row.coefficient = gather(contact, &Contact::restitution);
  row.closes = gather(contact, &Contact::closes);
  row.resting_acceleration = gather(contact, &Contact::resting_acceleration);
  row.acceleration = gather(contact, &Contact::acceleration);
}

/// Sets a point's friction from the contact cache, with no impulse.
SUBSTEP_KERNEL void start_friction(const Four<Contact>& contact, FrictionRows& rows) {
  rows.slid = gather(contact, &Contact::slid);
  rows.reference[0] = gather(contact, &Contact::displacement_1);
  rows.reference[1] = gather(contact, &Contact::displacement_2);
  rows.row[0].impulse = rows.row[1].impulse = rows.origin[0] = rows.origin[1] = all(0);
  rows.origin_normal = rows.slides = all(0);
}

/// Formulates the rows along the two tangents.
SUBSTEP_KERNEL void formulate_friction(const ContactBatch& x, const BatchBodies& at,
                                       const Four<Contact>& contact, const PointArms& arms,
                                       const Direction* tangent, const Formulation& from,
                                       FrictionRows& rows) {
  const auto is_released = keeps_sliding(rows) > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(at, arms, tangent[k], row);
    rows.reference[k] = choose(is_released, -distance, rows.reference[k]);
    row.beta = -(distance + rows.reference[k]) / all(from.hs);
  }
  const RowResponses first = responses_of(x, rows.row[0]);
  const RowResponses second = responses_of(x, rows.row[1]);
  const LaneVectors& one = tangent[0].in_world;
  const LaneVectors& other = tangent[1].in_world;
  rows.gamma[0] = coupling(at, dot(one, one), rows.row[0], first);
  rows.gamma[1] = coupling(at, dot(one, other), rows.row[0], second);
  rows.gamma[2] = coupling(at, dot(other, other), rows.row[1], second);
  invert(rows);
}

/// Moves friction's displacement from the point of the last formulation to the present point.
SUBSTEP_KERNEL void move_point(const BatchBodies& at, const PointArms& arms, const Direction* tangent,
                               const PointArms& before, FrictionRows& rows) {
  const LaneVectors on_a = turned_back(at.rotation_b, turned(at.rotation_a, before.a - arms.a));
  const LaneVectors back = on_a - (before.b - arms.b);
  rows.reference[0] += dot(tangent[0].in_b, back);
  rows.reference[1] += dot(tangent[1].in_b, back);
}

/// Sets Γ of a manifold's normals, each row divided by its diagonal element.
SUBSTEP_KERNEL void couple(const ContactBatch& x, const BatchBodies& at, const PointRows& rows) {
  const int count = x.contacts;
  for (int j = 0; j < count; ++j) {
    NormalRow& normal = rows.normals[j];
    const RowResponses responses = responses_of(x, normal.row);
    for (int i = j; i < count; ++i) {
      const Lanes along = dot(rows.directions[i].normal, rows.directions[j].normal);
      rows.couplings[i * count + j].value = rows.couplings[j * count + i].value =
          coupling(at, along, rows.normals[i].row, responses);
    }
    normal.effective_mass = inverse_or_zero(rows.couplings[j * count + j].value);
  }
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      if (j != i) rows.couplings[i * count + j].value *= rows.normals[i].effective_mass;
    }
  }
}

/// Disables the rows beyond a manifold's contacts, where its batch has more, so that they get no impulse.
inline void leave_out(const ContactBatch& x, const PointRows& rows) {
  for (int lane = 0; lane < lanes; ++lane) {
    for (int i = x.count[lane]; i < x.contacts; ++i) {
      rows.normals[i].effective_mass[lane] = 0;
      for (int j = 0; j < x.contacts; ++j)
        rows.couplings[i * x.contacts + j].value[lane] = rows.couplings[j * x.contacts + i].value[lane] = 0;
      if (!x.has_friction) continue;
      FrictionRows& friction = rows.frictions[i];
      friction.inverse_determinant[lane] = friction.inverse_largest[lane] = friction.slid[lane] = 0;
      for (Lanes& gamma : friction.gamma) gamma[lane] = 0;
      friction.origin_normal[lane] = -1;  // within its disc, so that its batch need not slide for it
    }
  }
}

/// s2 of a batch of points: directions, arms, β and Γ.
SUBSTEP_KERNEL void formulate_points(ContactBatches& contacts, const ContactBatch& x, const BatchBodies& at,
                                     const Formulation& from) {
  const PointRows rows = contacts.points_of(x);
  Direction directions[3]{};
  const Direction& normal_direction = directions[0];
  const Direction* const tangents = directions + 1;
  for (int i = 0; i < x.contacts; ++i) {
    const Four<Contact> contact = contacts_of(x, i, from.contacts);
    set_directions(at, x, contact, from, directions, rows.directions[i]);
    PointArms arms{gather(contact, &Contact::arm_a), gather(contact, &Contact::arm_b)};
    if (from.substep > 0) {
      roll(contact, normal_direction, arms);
      follow(at, contact, normal_direction, from.substep, arms);
    }
    NormalRow& normal = rows.normals[i];
    if (from.substep == 0) normal.row.impulse = normal.low = all(0);
    // A positive distance may close in the sub-step, and no more.
    const Lanes gap = set_row(at, arms, normal_direction, normal.row) + gather(contact, &Contact::left_over) +
                      gather(contact, &Contact::gap_offset);
    normal.row.beta = -gap / all(from.hs);
    if (rows.restitutions) {
      if (from.substep == 0) start_restitution(contact, rows.restitutions[i]);
      rows.restitutions[i].gap = gap;
    }
    if (!x.has_friction) continue;
    if (from.substep > 0) {
      move_point(at, arms, tangents, rows.arms[i], rows.frictions[i]);
    } else {
      start_friction(contact, rows.frictions[i]);
    }
    rows.arms[i] = arms;
    formulate_friction(x, at, contact, arms, tangents, from, rows.frictions[i]);
  }
  couple(x, at, rows);
  if (std::ranges::any_of(x.count, [&](int count) { return count < x.contacts; })) leave_out(x, rows);
}

}  // namespace

void formulate(ContactBatches& contacts, const std::vector<Contact>& found, const std::vector<Coordinates>& q,
               const std::vector<Matrix3>& rotations, double hs) {
  if (contacts.formulations == 0) contacts.first_rotations = rotations;
  const Formulation from{found, q, rotations, hs, contacts.formulations, contacts.first_rotations};
  run_wide([&]() __attribute__((always_inline)) {
    for (const ContactBatch& x : contacts.batches) {
      const BatchBodies at = bodies_of(x, from);
      x.patch >= 0 ? formulate_patch(contacts, x, at, from) : formulate_points(contacts, x, at, from);
    }
  });
  ++contacts.formulations;
}

}  // namespace substep
