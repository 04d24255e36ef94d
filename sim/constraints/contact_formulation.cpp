// s2 of contacts: rows, limits' origins and Γ, from coordinates.

#include "sim/constraints/four_wide.h"
#include "sim/constraints/lanes.h"

namespace substep {
namespace {

/// What a step's rows are formulated from.
struct Formulation {
  const Model& model;
  const std::vector<Contact>& contacts;
  const std::vector<Coordinates>& q;
  const std::vector<Matrix3>& rotations;
  bool in_body_frames;
  double hs;
  bool anew;  ///< not for the first time in the step
  const std::vector<Matrix3>& first_rotations;
};

/// The bodies' part of a batch's formulation.
struct BatchBodies {
  LaneMatrices rotation_a;
  LaneMatrices rotation_b;
  LaneVectors inverse_inertia_a;
  LaneVectors inverse_inertia_b;
  LaneVectors offset;  ///< from b's centre of mass to a's
  Lanes inverse_mass;  ///< both bodies'
};

[[gnu::always_inline]] inline BatchBodies bodies_of(const ContactBatch& x, const Formulation& from) {
  const auto& masses = from.model.masses;
  const auto& q = from.q;
  BatchBodies at;
  at.rotation_a = gather_rotations(from.rotations, x.a);
  at.rotation_b = gather_rotations(from.rotations, x.b);
  at.inverse_inertia_a = gather(masses[x.a[0]].inverse_inertia, masses[x.a[1]].inverse_inertia,
                                masses[x.a[2]].inverse_inertia, masses[x.a[3]].inverse_inertia);
  at.inverse_inertia_b = gather(masses[x.b[0]].inverse_inertia, masses[x.b[1]].inverse_inertia,
                                masses[x.b[2]].inverse_inertia, masses[x.b[3]].inverse_inertia);
  const LaneVectors to_a = gather(q[x.a[0]].linear, q[x.a[1]].linear, q[x.a[2]].linear, q[x.a[3]].linear);
  const LaneVectors to_b = gather(q[x.b[0]].linear, q[x.b[1]].linear, q[x.b[2]].linear, q[x.b[3]].linear);
  at.offset = {{to_a[0] - to_b[0], to_a[1] - to_b[1], to_a[2] - to_b[2]}};
  at.inverse_mass = x.inverse_mass_a + x.inverse_mass_b;
  return at;
}

/// J and M⁻¹Jᵀ of a row along `direction_b`, which is fixed in b; returns the contact's distance along it.
[[gnu::always_inline]] inline Lanes set_row(const BatchBodies& at, const LaneVectors& arm_a,
                                            const LaneVectors& arm_b, const LaneVectors& direction_b,
                                            bool in_body_frames, ContactRow& row) {
  const LaneVectors direction = turned(at.rotation_b, direction_b);
  const LaneVectors direction_a = turned_back(at.rotation_a, direction);
  const LaneVectors local_a = cross(arm_a, direction_a);
  const LaneVectors local_b = cross(direction_b, arm_b);
  const LaneVectors response_a = product(at.inverse_inertia_a, local_a);
  const LaneVectors response_b = product(at.inverse_inertia_b, local_b);
  row.linear = direction;
  if (in_body_frames) {
    row.angular_a = local_a;
    row.angular_b = local_b;
    row.response_a = response_a;
    row.response_b = response_b;
  } else {
    row.angular_a = turned(at.rotation_a, local_a);
    row.angular_b = turned(at.rotation_b, local_b);
    row.response_a = turned(at.rotation_a, response_a);
    row.response_b = turned(at.rotation_b, response_b);
  }
  return dot(direction, at.offset) + dot(direction_a, arm_a) - dot(direction_b, arm_b);
}

/// An element of Γ.
[[gnu::always_inline]] inline Lanes coupling(const BatchBodies& at, const ContactRow& one,
                                             const ContactRow& other) {
  return dot(one.linear, other.linear) * at.inverse_mass + dot(one.angular_a, other.response_a) +
         dot(one.angular_b, other.response_b);
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

/// A contact point: arms in body frames, directions in b's.
struct PointGeometry {
  LaneVectors arm_a;
  LaneVectors arm_b;
  LaneVectors normal;
  LaneVectors tangent[2];
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
                                             PointGeometry& point) {
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
[[gnu::always_inline]] inline void roll(const BatchBodies& at, const ContactBatch& x,
                                        const FourContacts& contact, const Formulation& from,
                                        PointGeometry& point) {
  turn_back(at, x, contact, from, point);
  const auto rolls_a = gather(contact, &Contact::rolls_a) > all(0);
  if (any(rolls_a)) {
    const LaneVectors arm =
        lowest(gather(contact, &Contact::ellipsoid_a), gather(contact, &Contact::centre_a),
               turned_back(at.rotation_a, turned(at.rotation_b, point.normal)));
    for (int k = 0; k < 3; ++k) point.arm_a[k] = choose(rolls_a, arm[k], point.arm_a[k]);
  }
  const auto rolls_b = gather(contact, &Contact::rolls_b) > all(0);
  if (any(rolls_b)) {
    const LaneVectors& n = point.normal;
    const LaneVectors arm = lowest(gather(contact, &Contact::ellipsoid_b),
                                   gather(contact, &Contact::centre_b), {{-n[0], -n[1], -n[2]}});
    for (int k = 0; k < 3; ++k) point.arm_b[k] = choose(rolls_b, arm[k], point.arm_b[k]);
  }
}

[[gnu::always_inline]] inline PointGeometry geometry_of(const BatchBodies& at, const ContactBatch& x,
                                                        const FourContacts& contact,
                                                        const Formulation& from) {
  PointGeometry point{gather(contact, &Contact::arm_a),
                      gather(contact, &Contact::arm_b),
                      gather(contact, &Contact::normal_b),
                      {gather(contact, &Contact::tangent_b1), gather(contact, &Contact::tangent_b2)}};
  if (from.anew) roll(at, x, contact, from, point);
  return point;
}

[[gnu::always_inline]] inline void formulate_friction(const BatchBodies& at, const FourContacts& contact,
                                                      const PointGeometry& point, const Formulation& from,
                                                      FrictionRows& rows) {
  const auto lets_go = rows.keeps_sliding > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(at, point.arm_a, point.arm_b, point.tangent[k], from.in_body_frames, row);
    rows.reference[k] = choose(lets_go, -distance, rows.reference[k]);
    row.beta = -(distance + rows.reference[k]) / all(from.hs);
  }
  rows.gamma[0] = coupling(at, rows.row[0], rows.row[0]);
  rows.gamma[1] = coupling(at, rows.row[0], rows.row[1]);
  rows.gamma[2] = coupling(at, rows.row[1], rows.row[1]);
  invert(rows);
}

/// The displacement goes on from the point that was to the point that is.
[[gnu::always_inline]] inline void move_point(const BatchBodies& at, const PointGeometry& point,
                                              TouchingPoint& touching, FrictionRows& rows) {
  const LaneVectors on_a =
      turned_back(at.rotation_b, turned(at.rotation_a, difference(touching.arm_a, point.arm_a)));
  const LaneVectors back = difference(on_a, difference(touching.arm_b, point.arm_b));
  rows.reference[0] += dot(point.tangent[0], back);
  rows.reference[1] += dot(point.tangent[1], back);
  touching = {point.arm_a, point.arm_b};
}

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* friction = contacts.frictions.data() + x.first_friction;
  TouchingPoint* touching = contacts.touching.data() + x.first_friction;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, from.contacts);
    const PointGeometry point = geometry_of(at, x, contact, from);
    ContactRow& row = normals[i].row;
    // A positive distance is admitted too: β lets it close, no more.
    const Lanes gap = set_row(at, point.arm_a, point.arm_b, point.normal, from.in_body_frames, row) +
                      gather(contact, &Contact::left_over);
    row.beta = -gap / all(from.hs);
    if (x.first_restitution >= 0) contacts.restitutions[x.first_restitution + i].gap = gap;
    if (contact[0]->friction == 0) continue;
    if (from.anew) move_point(at, point, *touching++, *friction);
    formulate_friction(at, contact, point, from, *friction);
    ++friction;
  }
  Coupling* const gamma = contacts.couplings.data() + x.first_coupling;
  for (int i = 0; i < x.contacts; ++i) {
    for (int j = 0; j <= i; ++j) {
      gamma[i * x.contacts + j].gamma = gamma[j * x.contacts + i].gamma =
          coupling(at, normals[i].row, normals[j].row);
    }
    const Lanes own = gamma[i * x.contacts + i].gamma;
    normals[i].effective_mass = choose(own > all(0), all(1) / own, all(0));
  }
}

void formulate_two_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}
[[gnu::target("avx2")]] void formulate_four_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
}

}  // namespace

void formulate(ContactBatches& contacts, const Model& model, const std::vector<Contact>& found,
               const std::vector<Coordinates>& q, const std::vector<Matrix3>& rotations, bool in_body_frames,
               double hs) {
  const bool anew = contacts.formulations > 0;
  if (!anew) contacts.first_rotations = rotations;
  const Formulation from{model, found, q, rotations, in_body_frames, hs, anew, contacts.first_rotations};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
  ++contacts.formulations;
}

}  // namespace substep
