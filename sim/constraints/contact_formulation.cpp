// s2 of contacts: rows, limits' origins and Γ, from coordinates.

#include "sim/constraints/contact_patch.h"
#include "sim/constraints/lanes.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

/// What a step's rows are formulated from.
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

/// An element of Γ: `linear` is the product of both directions.
[[gnu::always_inline]] inline Lanes coupling(const BatchBodies& at, const Lanes& linear,
                                             const ContactRow& one, const RowResponses& other) {
  return linear * at.inverse_mass + dot(one.angular_a, other.a) + dot(one.angular_b, other.b);
}

/// What solving divides by. Where Γ is singular to rounding, its trace counts for both rows.
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

/// Of a contact point, in b's frame.
struct PointDirections {
  LaneVectors normal;
  LaneVectors tangent[2];
};

/// Of a contact point, body frames.
struct PointArms {
  LaneVectors a;
  LaneVectors b;
};

/// Where a normal, which points out of what it touches, meets an ellipsoid. All in one body's frame.
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

/// What is remembered of a point, and what a step starts from.
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

/// Where a manifold has fewer contacts than its batch, what is beyond takes and gives no impulse.
void leave_out(const ContactBatch& x, NormalRow* normals, FrictionRows* frictions, Coupling* couplings) {
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

/// Four patches' numbers, by a member of PatchShape.
struct FourShapes {
  std::array<const PatchShape*, lanes> shape;

  template <typename Value>
  [[gnu::always_inline]] Lanes of(const Value& value) const {
    return Lanes{value(*shape[0]), value(*shape[1]), value(*shape[2]), value(*shape[3])};
  }
  [[gnu::always_inline]] LaneVectors of(Vector3 PatchShape::*member) const {
    return gather(shape[0]->*member, shape[1]->*member, shape[2]->*member, shape[3]->*member);
  }
  [[gnu::always_inline]] LaneVectors column(Matrix3 PatchShape::*member, int k) const {
    return gather((shape[0]->*member).col(k), (shape[1]->*member).col(k), (shape[2]->*member).col(k),
                  (shape[3]->*member).col(k));
  }
};

/// Γ of a patch: what wrenches at its centre change of the motion there.
struct PatchGamma {
  Lanes linear_by_force[9];
  Lanes linear_by_torque[9];  ///< transposed: turning by a force
  Lanes turning_by_torque[9];
};

/// Adds one body's part.
[[gnu::always_inline]] inline void add_body(const LaneVectors (&axes)[3], const LaneVectors& arm,
                                            const Lanes& inverse_mass, const LaneVectors& inverse_inertia,
                                            PatchGamma& gamma) {
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
    gamma.turning_by_torque[i] += m[i];
  }
}

/// Inverts a symmetric matrix (11, 12, 13, 22, 23, 33); 0 where it is singular.
[[gnu::always_inline]] inline void invert(const Lanes (&s)[6], Lanes (&inverse)[6]) {
  inverse[0] = s[3] * s[5] - s[4] * s[4];
  inverse[1] = s[2] * s[4] - s[1] * s[5];
  inverse[2] = s[1] * s[4] - s[2] * s[3];
  inverse[3] = s[0] * s[5] - s[2] * s[2];
  inverse[4] = s[1] * s[2] - s[0] * s[4];
  inverse[5] = s[0] * s[3] - s[1] * s[1];
  const Lanes determinant = s[0] * inverse[0] + s[1] * inverse[1] + s[2] * inverse[2];
  const Lanes factor = choose(determinant > all(0), all(1) / determinant, all(0));
  for (Lanes& element : inverse) element *= factor;
}

/// Γ⁻¹ of normals whose points lie on a line: on the wrenches that they can give, whose torque is `across`
/// it.
[[gnu::always_inline]] inline void invert_on_line(const Lanes (&s)[6], const Lanes (&across)[2],
                                                  Lanes (&inverse)[6]) {
  const Lanes c00 = s[0];
  const Lanes c01 = s[1] * across[0] + s[2] * across[1];
  const Lanes c11 =
      across[0] * across[0] * s[3] + all(2) * across[0] * across[1] * s[4] + across[1] * across[1] * s[5];
  const Lanes determinant = c00 * c11 - c01 * c01;
  const Lanes factor = choose(determinant > all(0), all(1) / determinant, all(0));
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

[[gnu::always_inline]] inline Lanes inverse_or_zero(const Lanes& x) {
  return choose(x > all(0), all(1) / x, all(0));
}

/// Sets a patch's Γ, its inverses, and where friction and normals meet.
[[gnu::always_inline]] inline void set_gamma(const ContactBatch& x, const FourShapes& from, Patch& patch) {
  const Lanes zero = all(0);
  PatchGamma gamma;
  for (int i = 0; i < 9; ++i) {
    gamma.linear_by_force[i] = gamma.linear_by_torque[i] = gamma.turning_by_torque[i] = zero;
  }
  add_body(patch.in_a, patch.arm_a, x.inverse_mass_a, x.inverse_inertia_a, gamma);
  add_body(patch.in_b, patch.arm_b, x.inverse_mass_b, x.inverse_inertia_b, gamma);
  const Lanes* const g = gamma.linear_by_force;
  const Lanes* const k = gamma.linear_by_torque;
  const Lanes* const m = gamma.turning_by_torque;
  const Lanes normal[6] = {g[0], k[1], k[2], m[4], m[5], m[8]};
  const Lanes friction[6] = {g[4], g[5], k[3], g[8], k[6], m[0]};
  const Lanes by_normals[9] = {g[3], k[4], k[5], g[6], k[7], k[8], k[0], m[1], m[2]};
  for (int i = 0; i < 6; ++i) patch.normal_gamma[i] = normal[i];
  for (int i = 0; i < 6; ++i) patch.gamma[i] = friction[i];
  for (int i = 0; i < 9; ++i) patch.by_normals[i] = by_normals[i];
  invert(patch.normal_gamma, patch.normal_inverse);
  const auto is_line = patch.corners == all(2);
  if (any(is_line)) {
    const auto side = [&](int axis) {
      return from.of([&](const PatchShape& s) { return s.corner[1][axis] - s.corner[0][axis]; });
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
  const Lanes half_difference = all(0.5) * (friction[0] - friction[3]);
  const Lanes largest = all(0.5) * (friction[0] + friction[3]) +
                        root(half_difference * half_difference + friction[1] * friction[1]);
  const Lanes of_twist = friction[5] / (patch.inverse_radius * patch.inverse_radius);
  patch.largest = larger(largest, of_twist);
}

/// Sets the planes and rays of the cone of a patch's normals.
[[gnu::always_inline]] inline void set_corners(const ContactBatch& x, const FourShapes& from,
                                               const Patch& patch, PatchCorner* corners) {
  const auto place = [&](int i, int axis) {
    return from.of(
        [&](const PatchShape& shape) { return shape.corner[std::min(i, shape.corners - 1)][axis]; });
  };
  const auto next = [&](int i, int axis) {
    return from.of(
        [&](const PatchShape& shape) { return shape.corner[i + 1 < shape.corners ? i + 1 : 0][axis]; });
  };
  const Lanes squared_radius = from.of([](const PatchShape& shape) { return shape.radius * shape.radius; });
  for (int i = 0; i < x.corners; ++i) {
    PatchCorner& corner = corners[i];
    const Lanes here[2] = {place(i, 0), place(i, 1)};
    const Lanes along[2] = {next(i, 0) - here[0], next(i, 1) - here[1]};
    corner.place[0] = here[0];
    corner.place[1] = here[1];
    // Its length does not matter.
    corner.plane = {{along[1] * here[0] - along[0] * here[1], along[0], along[1]}};
    // An end of a line: the centre of pressure is on the side of the other.
    const auto is_end = patch.corners == all(2);
    corner.plane[0] = choose(is_end, -(here[0] * along[0] + here[1] * along[1]), corner.plane[0]);
    corner.plane[1] = choose(is_end, along[1], corner.plane[1]);
    corner.plane[2] = choose(is_end, -along[0], corner.plane[2]);
    // A patch with fewer corners repeats its last, whose plane is then that of forces that push, in the
    // others' unit.
    const auto is_beyond = patch.corners <= all(i);
    for (int k = 0; k < 3; ++k)
      corner.plane[k] = choose(is_beyond, k == 0 ? squared_radius : all(0), corner.plane[k]);
    const LaneVectors back = symmetric_product(patch.normal_inverse, corner.plane);
    const Lanes scale = inverse_or_zero(dot(corner.plane, back));
    const LaneVectors ray{{all(1), corner.place[1], -corner.place[0]}};
    const LaneVectors response = symmetric_product(patch.normal_gamma, ray);
    corner.gamma = dot(ray, response);
    const Lanes inverse_gamma = inverse_or_zero(corner.gamma);
    for (int k = 0; k < 3; ++k) {
      corner.to_plane[k] = back[k] * scale;
      corner.to_ray[k] = response[k] * inverse_gamma;
    }
  }
}

/// Sets what a step starts from.
[[gnu::always_inline]] inline void start_patch(const FourShapes& from, Patch& patch) {
  const Lanes zero = all(0);
  patch.normal_impulse = patch.impulse = patch.origin = {{zero, zero, zero}};
  patch.origin_normal = patch.slides = zero;
  patch.slid = from.of([](const PatchShape& shape) { return shape.slid ? 1.0 : 0.0; });
  patch.coefficient = from.of([](const PatchShape& shape) { return shape.friction; });
  patch.inverse_radius = all(1) / from.of([](const PatchShape& shape) { return shape.radius; });
  patch.corners = from.of([](const PatchShape& shape) { return static_cast<double>(shape.corners); });
  for (int k = 0; k < 3; ++k) {
    patch.reference[k] = from.of([&](const PatchShape& shape) { return shape.reference[k]; });
  }
}

/// s2 of a batch of patches: axes, arms, β and Γ.
[[gnu::always_inline]] inline void formulate_patch(ContactBatches& contacts, const ContactBatch& x,
                                                   const BatchBodies& at, const Formulation& from) {
  const FourShapes shapes{{&contacts.shapes[x.shape[0]], &contacts.shapes[x.shape[1]],
                           &contacts.shapes[x.shape[2]], &contacts.shapes[x.shape[3]]}};
  Patch& patch = contacts.patches[x.patch];
  if (!from.anew) start_patch(shapes, patch);
  // Take the axes from b, and the arms of the centre.
  LaneVectors first_in_a[3];
  for (int k = 0; k < 3; ++k) {
    patch.in_b[k] = shapes.column(&PatchShape::axes_in_b, k);
    patch.in_world[k] = turned(at.rotation_b, patch.in_b[k]);
    patch.in_a[k] = turned_back(at.rotation_a, patch.in_world[k]);
    first_in_a[k] = shapes.column(&PatchShape::axes_in_a, k);
  }
  patch.arm_a = along(patch.in_a, shapes.of(&PatchShape::arm_a));
  patch.arm_b = along(patch.in_b, shapes.of(&PatchShape::arm_b));
  // Measure how the patch has opened, tilted and slipped.
  const LaneVectors offset = along(patch.in_world, at.offset);
  LaneVectors apart;
  for (int k = 0; k < 3; ++k) apart[k] = offset[k] + patch.arm_a[k] - patch.arm_b[k];
  const auto value = [&](auto member, int k) {
    return shapes.of([&](const PatchShape& shape) { return (shape.*member)[k]; });
  };
  const Lanes per_substep = all(-1) / all(from.hs);
  const Lanes tilt[2] = {
      value(&PatchShape::tilt, 0) + value(&PatchShape::left, 1) - dot(first_in_a[0], patch.in_a[1]),
      value(&PatchShape::tilt, 1) + value(&PatchShape::left, 2) - dot(first_in_a[0], patch.in_a[2])};
  patch.normal_beta = {{(apart[0] + value(&PatchShape::left, 0)) * per_substep, tilt[1] * per_substep,
                        -tilt[0] * per_substep}};
  const LaneVectors slip{{apart[1], apart[2], dot(first_in_a[1], patch.in_a[2])}};
  const auto lets_go = keeps_sliding(patch) > all(0);
  for (int k = 0; k < 3; ++k) {
    patch.reference[k] = choose(lets_go, -slip[k], patch.reference[k]);
    patch.beta[k] = (slip[k] + patch.reference[k]) * per_substep;
  }
  set_gamma(x, shapes, patch);
  set_corners(x, shapes, patch, contacts.patch_corners.data() + x.first_corner);
}

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* const frictions = contacts.frictions.data() + x.first_friction;
  TouchingPoint* const touching = contacts.touching.data() + x.first_friction;
  ContactDirections* const directions = contacts.directions.data() + x.first_normal;
  RestitutionRow* const restitutions =
      x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution;
  if (x.patch >= 0) return formulate_patch(contacts, x, at, from);
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

void formulate_two_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}
[[gnu::target("avx2")]] void formulate_four_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}

}  // namespace

void formulate(ContactBatches& contacts, const std::vector<Contact>& found, const std::vector<Coordinates>& q,
               const std::vector<Matrix3>& rotations, double hs) {
  const bool anew = contacts.formulations > 0;
  if (!anew) contacts.first_rotations = rotations;
  const Formulation from{found, q, rotations, hs, anew, contacts.first_rotations};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
  ++contacts.formulations;
}

}  // namespace substep
