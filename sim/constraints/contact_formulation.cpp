// s2 of contacts: rows, limits' origins and Γ, from coordinates.

#include "sim/constraints/contact_face.h"
#include "sim/constraints/four_wide.h"
#include "sim/constraints/lanes.h"

namespace substep {
namespace {

/// What a step's rows are formulated from.
struct Formulation {
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

/// The angular parts of J and of M⁻¹Jᵀ of a row; returns the contact's distance along its direction.
/// `responses` is null for the bodies' frames.
[[gnu::always_inline]] inline Lanes set_row(const ContactBatch& x, const BatchBodies& at,
                                            const LaneVectors& arm_a, const LaneVectors& arm_b,
                                            const Direction& along, ContactRow& row,
                                            RowResponses* responses) {
  const LaneVectors local_a = cross(arm_a, along.in_a);
  const LaneVectors local_b = cross(along.in_b, arm_b);
  if (responses) {
    row.angular_a = turned(at.rotation_a, local_a);
    row.angular_b = turned(at.rotation_b, local_b);
    responses->a = turned(at.rotation_a, product(x.inverse_inertia_a, local_a));
    responses->b = turned(at.rotation_b, product(x.inverse_inertia_b, local_b));
  } else {
    row.angular_a = local_a;
    row.angular_b = local_b;
  }
  return dot(along.in_world, at.offset) + dot(along.in_a, arm_a) - dot(along.in_b, arm_b);
}

/// A row's M⁻¹Jᵀ, which in the bodies' frames is a product.
[[gnu::always_inline]] inline RowResponses responses_of(const ContactBatch& x, const ContactRow& row,
                                                        const RowResponses* in_world) {
  if (in_world) return *in_world;
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
                                                      RowResponses* in_world, FrictionRows& rows) {
  const auto lets_go = keeps_sliding(rows) > all(0);
  rows.coefficient = gather(contact, &Contact::friction);
  for (int k = 0; k < 2; ++k) {
    ContactRow& row = rows.row[k];
    const Lanes distance = set_row(x, at, arms.a, arms.b, tangent[k], row, in_world ? in_world + k : nullptr);
    rows.reference[k] = choose(lets_go, -distance, rows.reference[k]);
    row.beta = -(distance + rows.reference[k]) / all(from.hs);
  }
  const RowResponses first = responses_of(x, rows.row[0], in_world);
  const RowResponses second = responses_of(x, rows.row[1], in_world ? in_world + 1 : nullptr);
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
                                          const ContactDirections* directions, const RowResponses* in_world,
                                          Coupling* couplings) {
  const int count = x.contacts;
  for (int j = 0; j < count; ++j) {
    const RowResponses responses = responses_of(x, normals[j].row, in_world ? in_world + j : nullptr);
    for (int i = j; i < count; ++i) {
      const Lanes along =
          dot(directions[i * x.direction_step].normal, directions[j * x.direction_step].normal);
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

/// Where a face's points are. The first says where the centre is across the normal, the deepest along it.
struct FaceArms {
  PointArms point[most_in_manifold];
  Lanes height_a;
  Lanes height_b;
};

[[gnu::always_inline]] inline void set_face_arms(const ContactBatch& x, const Direction& normal,
                                                 const Formulation& from, FaceArms& face) {
  Lanes least;
  for (int i = 0; i < x.contacts; ++i) {
    face.point[i] = arms_of(contacts_of(x, i, from.contacts), normal, from.anew);
    const Lanes height_a = dot(normal.in_a, face.point[i].a);
    const Lanes height_b = dot(normal.in_b, face.point[i].b);
    const Lanes gap = height_a - height_b;
    if (i == 0) {
      face.height_a = height_a;
      face.height_b = height_b;
      least = gap;
      continue;
    }
    const auto deeper = gap < least;
    least = choose(deeper, gap, least);
    face.height_a = choose(deeper, height_a, face.height_a);
    face.height_b = choose(deeper, height_b, face.height_b);
  }
}

/// Where friction of a face's point acts.
[[gnu::always_inline]] inline PointArms at_height(const FaceArms& face, const Direction& normal,
                                                  const PointArms& arms) {
  const Lanes up_a = face.height_a - dot(normal.in_a, arms.a);
  const Lanes up_b = face.height_b - dot(normal.in_b, arms.b);
  PointArms result = arms;
  for (int k = 0; k < 3; ++k) {
    result.a[k] += up_a * normal.in_a[k];
    result.b[k] += up_b * normal.in_b[k];
  }
  return result;
}

/// R I⁻¹ Rᵀ.
[[gnu::always_inline]] inline void set_inertia(const LaneMatrices& rotation,
                                               const LaneVectors& inverse_inertia,
                                               LaneVectors (&inertia)[3]) {
  for (int k = 0; k < 3; ++k) {
    const LaneVectors row{{rotation.column[0][k], rotation.column[1][k], rotation.column[2][k]}};
    inertia[k] = turned(rotation, product(inverse_inertia, row));
  }
}

[[gnu::always_inline]] inline LaneVectors all_zero() {
  const Lanes zero = all(0);
  return {{zero, zero, zero}};
}

/// What a force at the centre and torques on the bodies change.
[[gnu::always_inline]] inline RelativeMotion change_by(const ContactBatch& x, const ContactFace& face,
                                                       const FaceInertias* inertia, const LaneVectors& force,
                                                       const LaneVectors& torque_a,
                                                       const LaneVectors& torque_b) {
  Moving a{all_zero(), all_zero()};
  Moving b{all_zero(), all_zero()};
  push(x, inertia, force, torque_a, torque_b, a, b);
  return relative_motion(face, a, b);
}

/// Of a unit of force along the first or the second tangent: torque_on() without what is zero.
[[gnu::always_inline]] inline LaneVectors torque_of_tangent(const LaneVectors (&axes)[3],
                                                            const LaneVectors& arm, int tangent) {
  LaneVectors torque;
  for (int k = 0; k < 3; ++k) {
    torque[k] =
        tangent == 1 ? axes[2][k] * arm[0] - axes[0][k] * arm[2] : axes[0][k] * arm[1] - axes[1][k] * arm[0];
  }
  return torque;
}

[[gnu::always_inline]] inline RelativeMotion change_by_tangent(const ContactBatch& x, const ContactFace& face,
                                                               const FaceInertias* inertia, int tangent) {
  return change_by(x, face, inertia, face.in_world[tangent],
                   torque_of_tangent(face.in_a, face.arm_a, tangent),
                   torque_of_tangent(face.in_b, face.arm_b, tangent));
}

/// Of a component of friction, by what normals change.
[[gnu::always_inline]] inline void keep(const RelativeMotion& change, Lanes* by_normals) {
  by_normals[0] = change.linear[0];
  by_normals[1] = change.angular[1];
  by_normals[2] = change.angular[2];
}

[[gnu::always_inline]] inline void set_face(const ContactBatch& x, const BatchBodies& at,
                                            const TurnedDirections& along_all, const FaceArms& arms,
                                            FaceInertias* inertia, ContactFace& face) {
  const Direction* const axes[3] = {&along_all.normal, &along_all.tangent[0], &along_all.tangent[1]};
  face.arm_a[0] = arms.height_a;
  face.arm_b[0] = arms.height_b;
  for (int k = 0; k < 3; ++k) {
    face.in_world[k] = axes[k]->in_world;
    face.in_a[k] = inertia ? axes[k]->in_world : axes[k]->in_a;
    face.in_b[k] = inertia ? axes[k]->in_world : axes[k]->in_b;
    if (k == 0) continue;
    face.arm_a[k] = dot(axes[k]->in_a, arms.point[0].a);
    face.arm_b[k] = dot(axes[k]->in_b, arms.point[0].b);
  }
  if (inertia) {
    set_inertia(at.rotation_a, x.inverse_inertia_a, inertia->a);
    set_inertia(at.rotation_b, x.inverse_inertia_b, inertia->b);
  }
  Lanes* const gamma = face.gamma;
  const RelativeMotion one = change_by_tangent(x, face, inertia, 1);
  keep(one, &face.by_normals[0]);
  gamma[0] = one.linear[1];
  gamma[1] = one.linear[2];
  gamma[2] = one.angular[0];
  const RelativeMotion other = change_by_tangent(x, face, inertia, 2);
  keep(other, &face.by_normals[3]);
  gamma[3] = other.linear[2];
  gamma[4] = other.angular[0];
  const RelativeMotion spin = change_by(x, face, inertia, all_zero(), face.in_a[0], face.in_b[0]);
  keep(spin, &face.by_normals[6]);
  gamma[5] = spin.angular[0];
}

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  NormalRow* const normals = contacts.normals.data() + x.first_normal;
  FrictionRows* const frictions = contacts.frictions.data() + x.first_friction;
  TouchingPoint* const touching = contacts.touching.data() + x.first_friction;
  ContactDirections* const directions = contacts.directions.data() + x.first_direction;
  RestitutionRow* const restitutions =
      x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution;
  RowResponses* const in_world = from.in_body_frames ? nullptr : contacts.responses.data() + x.first_response;
  // Not set to zero first, as what is not read need not be: it is 4 kB.
  TurnedDirections turned_directions;
  FaceArms face;
  if (x.direction_step == 0) {
    set_directions(at, x, contacts_of(x, 0, from.contacts), from, turned_directions, directions[0]);
  }
  if (x.face >= 0) set_face_arms(x, turned_directions.normal, from, face);
  int friction = 0;
  bool all_as_long = true;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact = contacts_of(x, i, from.contacts);
    if (x.direction_step == 1) set_directions(at, x, contact, from, turned_directions, directions[i]);
    const PointArms arms =
        x.face >= 0 ? face.point[i] : arms_of(contact, turned_directions.normal, from.anew);
    ContactRow& row = normals[i].row;
    if (!from.anew) row.impulse = normals[i].low = all(0);
    // A positive distance is admitted too: β lets it close, no more.
    const Lanes gap =
        set_row(x, at, arms.a, arms.b, turned_directions.normal, row, in_world ? in_world + i : nullptr) +
        gather(contact, &Contact::left_over) + gather(contact, &Contact::gap_offset);
    row.beta = -gap / all(from.hs);
    if (x.face >= 0) {
      const LaneVectors from_first = difference(arms.a, face.point[0].a);
      for (int k = 0; k < 2; ++k) normals[i].place[k] = dot(turned_directions.tangent[k].in_a, from_first);
    }
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
    formulate_friction(x, at, contact, x.face < 0 ? arms : at_height(face, turned_directions.normal, arms),
                       turned_directions.tangent, from,
                       in_world ? in_world + x.contacts + 2 * friction : nullptr, rows);
    ++friction;
  }
  Coupling* const couplings = contacts.couplings.data() + x.first_coupling;
  couple(x, at, normals, directions, in_world, couplings);
  if (x.face >= 0) {
    set_face(x, at, turned_directions, face, in_world ? &contacts.inertias[x.face] : nullptr,
             contacts.faces[x.face]);
  }
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
               const std::vector<Matrix3>& rotations, bool in_body_frames, double hs) {
  const bool anew = contacts.formulations > 0;
  if (!anew) contacts.first_rotations = rotations;
  if (in_body_frames) {
    contacts.responses.clear();
    contacts.inertias.clear();
  } else {
    contacts.responses.reserve(3 * contacts.normals.capacity());
    contacts.inertias.reserve(contacts.faces.capacity());
    contacts.inertias.resize(contacts.faces.size());
    contacts.responses.resize(contacts.normals.size() + 2 * contacts.frictions.size());
  }
  const Formulation from{found, q, rotations, in_body_frames, hs, anew, contacts.first_rotations};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
  ++contacts.formulations;
}

}  // namespace substep
