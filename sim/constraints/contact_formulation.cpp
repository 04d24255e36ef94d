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

[[gnu::always_inline]] inline void formulate_friction(const BatchBodies& at, const FourContacts& contact,
                                                      const LaneVectors& arm_a, const LaneVectors& arm_b,
                                                      const Formulation& from, FrictionRows& rows) {
  const auto lets_go = rows.keeps_sliding > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  int k = 0;
  for (const auto tangent : {&Contact::tangent_b1, &Contact::tangent_b2}) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(at, arm_a, arm_b, gather(contact, tangent), from.in_body_frames, row);
    rows.reference[k] = choose(lets_go, -distance, rows.reference[k]);
    row.beta = -(distance + rows.reference[k]) / all(from.hs);
    ++k;
  }
  rows.gamma[0] = coupling(at, rows.row[0], rows.row[0]);
  rows.gamma[1] = coupling(at, rows.row[0], rows.row[1]);
  rows.gamma[2] = coupling(at, rows.row[1], rows.row[1]);
  invert(rows);
}

/// Formulated anew in a step (A3), a round surface's point has turned away from where it pushed: what it has
/// given there is not taken back here. Else what rolls would be braked. Balls need it not: see arm_of_a.
template <typename Mask>
[[gnu::always_inline]] inline void keep_given(const Lanes& normal, const Mask& round, FrictionRows& rows) {
  for (int k = 0; k < 2; ++k) rows.origin[k] = choose(round, rows.row[k].impulse, rows.origin[k]);
  rows.origin_normal = choose(round, normal, rows.origin_normal);
}

/// To the contact's point on a. Formulated anew in a step (A3), a ball has turned: its point is now another
/// of its surface, where the normal meets it.
[[gnu::always_inline]] inline LaneVectors arm_of_a(const BatchBodies& at, const FourContacts& contact,
                                                   bool anew) {
  LaneVectors arm = gather(contact, &Contact::arm_a);
  const auto on_sphere = gather(contact, &Contact::on_sphere) > all(0);
  if (!anew || !any(on_sphere)) return arm;
  const LaneVectors radius =
      turned_back(at.rotation_a, turned(at.rotation_b, gather(contact, &Contact::radius_b)));
  const LaneVectors centre = gather(contact, &Contact::centre_a);
  for (int k = 0; k < 3; ++k) arm[k] = choose(on_sphere, centre[k] + radius[k], arm[k]);
  return arm;
}

/// The displacement goes on from the point that was to the point that is.
[[gnu::always_inline]] inline void move_point(const BatchBodies& at, const FourContacts& contact,
                                              const LaneVectors& arm_a, FrictionRows& rows) {
  const LaneVectors back = turned_back(at.rotation_b, turned(at.rotation_a, difference(rows.arm_a, arm_a)));
  rows.reference[0] += dot(gather(contact, &Contact::tangent_b1), back);
  rows.reference[1] += dot(gather(contact, &Contact::tangent_b2), back);
  rows.arm_a = arm_a;
}

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* friction = contacts.frictions.data() + x.first_friction;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, from.contacts);
    const LaneVectors arm_a = arm_of_a(at, contact, contacts.formulations > 0);
    const LaneVectors arm_b = gather(contact, &Contact::arm_b);
    ContactRow& row = normals[i].row;
    // A positive distance is admitted too: β lets it close, no more.
    const Lanes gap =
        set_row(at, arm_a, arm_b, gather(contact, &Contact::normal_b), from.in_body_frames, row) +
        gather(contact, &Contact::left_over);
    row.beta = -gap / all(from.hs);
    if (x.first_restitution >= 0) contacts.restitutions[x.first_restitution + i].gap = gap;
    const auto round = gather(contact, &Contact::round) > all(0);
    normals[i].low = choose(round, row.impulse, normals[i].low);
    if (contact[0]->friction == 0) continue;
    if (contacts.formulations > 0) move_point(at, contact, arm_a, *friction);
    formulate_friction(at, contact, arm_a, arm_b, from, *friction);
    keep_given(row.impulse, round, *friction++);
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
  const Formulation from{model, found, q, rotations, in_body_frames, hs};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
  ++contacts.formulations;
}

}  // namespace substep
