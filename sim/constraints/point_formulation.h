#pragma once
/// s2 of manifolds that are solved point by point. Part of contact_formulation.cpp.

#include "sim/constraints/formulated_bodies.h"

namespace substep {

/// A direction that is fixed in b, as all see it.
struct Direction {
  LaneVectors in_b;
  LaneVectors in_world;
  LaneVectors in_a;
};

[[gnu::always_inline]] inline void set_direction(const BatchBodies& at, const LaneVectors& in_b,
                                                 Direction& direction) {
  // By components: gcc 12 copies a whole of this size as bytes, which is slow.
  const LaneVectors in_world = turned(at.rotation_b, in_b);
  const LaneVectors in_a = turned_back(at.rotation_a, in_world);
  for (int k = 0; k < 3; ++k) {
    direction.in_b[k] = in_b[k];
    direction.in_world[k] = in_world[k];
    direction.in_a[k] = in_a[k];
  }
}

/// The angular parts of J of a row; returns the contact's distance along its direction.
[[gnu::always_inline]] inline Lanes set_row(const BatchBodies& at, const LaneVectors& arm_a,
                                            const LaneVectors& arm_b, const Direction& along,
                                            ContactRow& row) {
  row.angular_a = cross(arm_a, along.in_a);
  row.angular_b = cross(along.in_b, arm_b);
  return dot(along.in_world, at.offset) + dot(along.in_a, arm_a) - dot(along.in_b, arm_b);
}

/// The angular parts of M⁻¹Jᵀ of a row.
struct RowResponses {
  LaneVectors a;
  LaneVectors b;
};

[[gnu::always_inline]] inline RowResponses responses_of(const ContactBatch& x, const ContactRow& row) {
  return {product(x.inverse_inertia_a, row.angular_a), product(x.inverse_inertia_b, row.angular_b)};
}

/// Returns an element of Γ: `linear` is the product of both directions.
[[gnu::always_inline]] inline Lanes coupling(const BatchBodies& at, const Lanes& linear,
                                             const ContactRow& one, const RowResponses& other) {
  return linear * at.inverse_mass + dot(one.angular_a, other.a) + dot(one.angular_b, other.b);
}

/// Inverts Γ. Where it is singular to rounding, its trace counts for both rows.
[[gnu::always_inline]] inline void invert(FrictionRows& rows) {
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
  const Lanes half_difference = all(0.5) * (rows.gamma[0] - rows.gamma[2]);
  const Lanes largest = all(0.5) * (rows.gamma[0] + rows.gamma[2]) +
                        root(half_difference * half_difference + rows.gamma[1] * rows.gamma[1]);
  rows.inverse_largest = choose(largest > zero, one / largest, zero);
}

/// Directions of a contact point, in b's frame.
struct PointDirections {
  LaneVectors normal;
  LaneVectors tangent[2];
};

/// Arms of a contact point, in the bodies' frames.
struct PointArms {
  LaneVectors a;
  LaneVectors b;
};

/// Returns the ellipsoid's farthest point against a normal, which points out of what it touches. All is in
/// one body's frame.
[[gnu::always_inline]] inline LaneVectors lowest(const LaneMatrices& ellipsoid, const LaneVectors& centre,
                                                 const LaneVectors& normal) {
  const LaneVectors reach = turned(ellipsoid, normal);
  // A circle across the normal has no lowest point.
  const Lanes distance = root(larger(dot(normal, reach), all(1e-24)));
  return {
      {centre[0] - reach[0] / distance, centre[1] - reach[1] / distance, centre[2] - reach[2] / distance}};
}

/// The normal and the tangents where they do not turn with b since the step's first formulation.
[[gnu::always_inline]] inline void turn_back(const BatchBodies& at, const ContactBatch& x,
                                             const FourContacts& contact, const Formulation& from,
                                             PointDirections& point) {
  const auto with_a = gather(contact, &Contact::turns_with_a) > all(0);
  const auto with_neither = gather(contact, &Contact::turns_with_neither) > all(0);
  if (!any(with_a) && !any(with_neither)) return;
  const LaneMatrices first_a = gather_rotations(from.first_rotations, x.a);
  const LaneMatrices first_b = gather_rotations(from.first_rotations, x.b);
  for (LaneVectors* direction : {&point.normal, &point.tangent[0], &point.tangent[1]}) {
    const LaneVectors first = turned(first_b, *direction);
    const LaneVectors turned_with_a =
        turned_back(at.rotation_b, turned(at.rotation_a, turned_back(first_a, first)));
    const LaneVectors fixed = turned_back(at.rotation_b, first);
    for (int k = 0; k < 3; ++k) {
      Lanes& component = (*direction)[k];
      component = choose(with_a, turned_with_a[k], choose(with_neither, fixed[k], component));
    }
  }
}

/// Formulated anew in a step (A3), a round body has turned: its point is now another of its surface, where
/// the normal meets it. Fixed in the body, it would leave the contact by what the body rolls, and push where
/// nothing touches; and a normal that turns with a round body would push aside.
[[gnu::always_inline]] inline void roll(const FourContacts& contact, const Direction& normal,
                                        PointArms& arms) {
  const auto rolls_a = gather(contact, &Contact::rolls_a) > all(0);
  if (any(rolls_a)) {
    const LaneVectors arm =
        lowest(gather(contact, &Contact::ellipsoid_a), gather(contact, &Contact::centre_a), normal.in_a);
    for (int k = 0; k < 3; ++k) arms.a[k] = choose(rolls_a, arm[k], arms.a[k]);
  }
  const auto rolls_b = gather(contact, &Contact::rolls_b) > all(0);
  if (any(rolls_b)) {
    const LaneVectors arm =
        lowest(gather(contact, &Contact::ellipsoid_b), gather(contact, &Contact::centre_b),
               {{-normal.in_b[0], -normal.in_b[1], -normal.in_b[2]}});
    for (int k = 0; k < 3; ++k) arms.b[k] = choose(rolls_b, arm[k], arms.b[k]);
  }
}

/// The directions of a contact point.
struct TurnedDirections {
  Direction normal;
  Direction tangent[2];
};

[[gnu::always_inline]] inline void set_directions(const BatchBodies& at, const ContactBatch& x,
                                                  const FourContacts& contact, const Formulation& from,
                                                  TurnedDirections& turned_directions,
                                                  ContactDirections& directions) {
  PointDirections point{gather(contact, &Contact::normal_b),
                        {gather(contact, &Contact::tangent_b1), gather(contact, &Contact::tangent_b2)}};
  if (from.anew) turn_back(at, x, contact, from, point);
  set_direction(at, point.normal, turned_directions.normal);
  directions.normal = turned_directions.normal.in_world;
  for (int k = 0; k < 2; ++k) {
    set_direction(at, point.tangent[k], turned_directions.tangent[k]);
    directions.tangent[k] = turned_directions.tangent[k].in_world;
  }
}

[[gnu::always_inline]] inline void start_restitution(const FourContacts& contact, RestitutionRow& row) {
  row.velocity = row.right = row.impact = all(0);
  row.coefficient = gather(contact, &Contact::restitution);
  row.closes = gather(contact, &Contact::closes);
  row.resting_acceleration = gather(contact, &Contact::resting_acceleration);
  row.acceleration = gather(contact, &Contact::acceleration);
}

/// Sets a point's friction to what is remembered of it, with no impulse.
[[gnu::always_inline]] inline void start_friction(const FourContacts& contact, FrictionRows& rows) {
  const Lanes zero = all(0);
  rows.slid = gather(contact, &Contact::slid);
  rows.reference[0] = gather(contact, &Contact::displacement_1);
  rows.reference[1] = gather(contact, &Contact::displacement_2);
  rows.row[0].impulse = rows.row[1].impulse = rows.origin[0] = rows.origin[1] = rows.origin_normal = zero;
  rows.slides = zero;
}

[[gnu::always_inline]] inline void formulate_friction(const ContactBatch& x, const BatchBodies& at,
                                                      const FourContacts& contact, const PointArms& arms,
                                                      const Direction (&tangent)[2], const Formulation& from,
                                                      FrictionRows& rows) {
  const auto lets_go = keeps_sliding(rows) > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(at, arms.a, arms.b, tangent[k], row);
    rows.reference[k] = choose(lets_go, -distance, rows.reference[k]);
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

/// The displacement goes on from the point that was to the point that is.
[[gnu::always_inline]] inline void move_point(const BatchBodies& at, const PointArms& arms,
                                              const Direction (&tangent)[2], const TouchingPoint& touching,
                                              FrictionRows& rows) {
  const LaneVectors on_a =
      turned_back(at.rotation_b, turned(at.rotation_a, difference(touching.arm_a, arms.a)));
  const LaneVectors back = difference(on_a, difference(touching.arm_b, arms.b));
  rows.reference[0] += dot(tangent[0].in_b, back);
  rows.reference[1] += dot(tangent[1].in_b, back);
}

/// Γ of a manifold's normals, each row by its diagonal.
[[gnu::always_inline]] inline void couple(const ContactBatch& x, const BatchBodies& at, NormalRow* normals,
                                          const ContactDirections* directions, Coupling* couplings) {
  const int count = x.contacts;
  for (int j = 0; j < count; ++j) {
    const RowResponses responses = responses_of(x, normals[j].row);
    for (int i = j; i < count; ++i) {
      const Lanes along = dot(directions[i].normal, directions[j].normal);
      couplings[i * count + j].share = couplings[j * count + i].share =
          coupling(at, along, normals[i].row, responses);
    }
    const Lanes own = couplings[j * count + j].share;
    normals[j].effective_mass = choose(own > all(0), all(1) / own, all(0));
  }
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      if (j != i) couplings[i * count + j].share *= normals[i].effective_mass;
    }
  }
}

/// Silences the rows beyond a manifold's contacts, where its batch has more: they take and give no impulse.
inline void leave_out(const ContactBatch& x, NormalRow* normals, FrictionRows* frictions,
                      Coupling* couplings) {
  for (int lane = 0; lane < lanes; ++lane) {
    for (int i = x.count[lane]; i < x.contacts; ++i) {
      normals[i].effective_mass[lane] = 0;
      for (int j = 0; j < x.contacts; ++j) {
        couplings[i * x.contacts + j].share[lane] = couplings[j * x.contacts + i].share[lane] = 0;
      }
    }
    for (int i = x.frictions_of(lane); i < x.frictions; ++i) {
      FrictionRows& rows = frictions[i];
      rows.inverse_determinant[lane] = rows.inverse_largest[lane] = rows.slid[lane] = 0;
      for (Lanes& gamma : rows.gamma) gamma[lane] = 0;
      rows.origin_normal[lane] = -1;  // within its disc, so that its batch need not slide for it
    }
  }
}

/// The arms of the i-th points.
[[gnu::always_inline]] inline PointArms arms_of(const FourContacts& contact, const Direction& normal,
                                                bool anew) {
  PointArms arms{gather(contact, &Contact::arm_a), gather(contact, &Contact::arm_b)};
  if (anew) roll(contact, normal, arms);
  return arms;
}

/// s2 of a batch of points: directions, arms, β and Γ.
[[gnu::always_inline]] inline void formulate_points(ContactBatches& contacts, const ContactBatch& x,
                                                    const BatchBodies& at, const Formulation& from) {
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* const frictions = contacts.frictions.data() + x.first_friction;
  TouchingPoint* const touching = contacts.touching.data() + x.first_friction;
  ContactDirections* const directions = contacts.directions.data() + x.first_normal;
  RestitutionRow* const restitutions =
      x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution;
  TurnedDirections turned_directions{};
  int friction = 0;
  bool all_as_long = true;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, from.contacts);
    set_directions(at, x, contact, from, turned_directions, directions[i]);
    const PointArms arms = arms_of(contact, turned_directions.normal, from.anew);
    ContactRow& row = normals[i].row;
    if (!from.anew) row.impulse = normals[i].low = all(0);
    // A positive distance is admitted too: β lets it close, no more.
    const Lanes gap = set_row(at, arms.a, arms.b, turned_directions.normal, row) +
                      gather(contact, &Contact::left_over) + gather(contact, &Contact::gap_offset);
    row.beta = -gap / all(from.hs);
    if (restitutions) {
      RestitutionRow& bounce = restitutions[i];
      if (!from.anew) start_restitution(contact, bounce);
      bounce.gap = gap;
    }
    if (friction == x.frictions || x.contact_of[friction] != i) continue;
    FrictionRows& rows = frictions[friction];
    if (from.anew) {
      move_point(at, arms, turned_directions.tangent, touching[friction], rows);
    } else {
      start_friction(contact, rows);
    }
    touching[friction] = {arms.a, arms.b};
    formulate_friction(x, at, contact, arms, turned_directions.tangent, from, rows);
    ++friction;
  }
  Coupling* const couplings = contacts.couplings.data() + x.first_coupling;
  couple(x, at, normals, directions, couplings);
  for (const int count : x.count) all_as_long = all_as_long && count == x.contacts;
  if (!all_as_long) leave_out(x, normals, frictions, couplings);
}

}  // namespace substep
