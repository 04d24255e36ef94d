#include "sim/contact_batch.h"

#ifdef __clang__
#define _Bool bool  // NOLINT: the next header is meant for C, and gcc's C++ knows this word of it
#endif
#include <sys/platform/x86.h>
#undef _Bool

#include <algorithm>
#include <tuple>

namespace substep {
namespace {

constexpr int most_mixed = 64;  // contacts of a pair, as far as bits tell which of them have friction

[[gnu::always_inline]] inline Lanes all(double value) {
  return Lanes{value, value, value, value};
}

/// Where `mask` is all ones, `yes`. Neither is computed with: a NaN stays where it is.
template <typename Mask>
[[gnu::always_inline]] inline Lanes choose(const Mask& mask, const Lanes& yes, const Lanes& no) {
  return mask ? yes : no;
}

/// As Eigen sums three products.
[[gnu::always_inline]] inline Lanes dot(const LaneVectors& a, const LaneVectors& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

[[gnu::always_inline]] inline LaneVectors gather(const Vector3& v0, const Vector3& v1, const Vector3& v2,
                                                 const Vector3& v3) {
  return {{Lanes{v0.x(), v1.x(), v2.x(), v3.x()}, Lanes{v0.y(), v1.y(), v2.y(), v3.y()},
           Lanes{v0.z(), v1.z(), v2.z(), v3.z()}}};
}

/// The velocities of one of the bodies of each pair.
struct Moving {
  LaneVectors linear;
  LaneVectors angular;
};

[[gnu::always_inline]] inline Moving gather(const std::vector<Velocity>& v,
                                            const std::array<int, lanes>& body) {
  const Velocity& v0 = v[body[0]];
  const Velocity& v1 = v[body[1]];
  const Velocity& v2 = v[body[2]];
  const Velocity& v3 = v[body[3]];
  return {gather(v0.linear, v1.linear, v2.linear, v3.linear),
          gather(v0.angular, v1.angular, v2.angular, v3.angular)};
}

[[gnu::always_inline]] inline void scatter(const Moving& from, const std::array<int, lanes>& body, int pairs,
                                           std::vector<Velocity>& v) {
  for (int lane = 0; lane < pairs; ++lane) {
    double* const linear = v[body[lane]].linear.data();
    double* const angular = v[body[lane]].angular.data();
    for (int k = 0; k < 3; ++k) {
      linear[k] = from.linear[k][lane];
      angular[k] = from.angular[k][lane];
    }
  }
}

/// J_x v.
[[gnu::always_inline]] inline Lanes row_velocity(const ContactRow& row, const Moving& a, const Moving& b) {
  const LaneVectors relative{
      {a.linear[0] - b.linear[0], a.linear[1] - b.linear[1], a.linear[2] - b.linear[2]}};
  return dot(row.linear, relative) + dot(row.angular_a, a.angular) + dot(row.angular_b, b.angular);
}

template <bool measured>
[[gnu::always_inline]] inline void solve_lanes(ContactRow* rows, const ContactBatch& x, const RowSolve& how,
                                               std::vector<Velocity>& v, double* moved) {
  const Lanes kappa = all(how.kappa);
  const Lanes tau = all(how.tau);
  const Lanes omega = all(how.omega);
  const Lanes scale = all(how.scale);
  const Lanes zero = all(0);
  Lanes most = zero;
  Moving a = gather(v, x.a);
  Moving b = gather(v, x.b);
  for (int r = x.first; r < x.first + x.count; ++r) {
    ContactRow& row = rows[r];
    const Lanes wanted = tau * row.beta - kappa * row_velocity(row, a, b);
    const Lanes free = row.impulse + omega * wanted * row.inverse_gamma;
    Lanes total;
    if (row.normal < 0) {
      total = choose(free < zero, zero, free);
    } else {
      const Lanes limit = row.friction * rows[row.normal].impulse;
      total = choose(free < -limit, -limit, choose(limit < free, limit, free));
    }
    const Lanes change = total - row.impulse;
    row.impulse = total;
    const Lanes impulse = scale * change;
    const Lanes impulse_a = x.inverse_mass_a * impulse;
    const Lanes impulse_b = x.inverse_mass_b * impulse;
    for (int k = 0; k < 3; ++k) {
      a.linear[k] += row.linear[k] * impulse_a;
      a.angular[k] += row.response_a[k] * impulse;
      b.linear[k] -= row.linear[k] * impulse_b;
      b.angular[k] += row.response_b[k] * impulse;
    }
    if constexpr (measured) {
      const Lanes size = choose(change < zero, -change, change) / row.inverse_gamma;
      most = choose(most < size, size, most);
    }
  }
  scatter(a, x.a, x.pairs, v);
  scatter(b, x.b, x.pairs, v);
  if constexpr (measured) {
    for (int lane = 0; lane < lanes; ++lane) *moved = std::max(*moved, most[lane]);
  }
}

[[gnu::always_inline]] inline LaneVectors cross(const LaneVectors& a, const LaneVectors& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

[[gnu::always_inline]] inline LaneVectors product(const LaneVectors& a, const LaneVectors& b) {
  return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}};
}

using FourContacts = std::array<const Contact*, lanes>;

[[gnu::always_inline]] inline LaneVectors gather(const FourContacts& contact, Vector3 Contact::*member) {
  return gather(contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member);
}

[[gnu::always_inline]] inline Lanes gather(const FourContacts& contact, double Contact::*member) {
  return Lanes{contact[0]->*member, contact[1]->*member, contact[2]->*member, contact[3]->*member};
}

/// A rotation matrix of each of four, by columns.
struct LaneMatrices {
  LaneVectors column[3];
};

[[gnu::always_inline]] inline LaneMatrices gather_rotations(const std::vector<Matrix3>& rotations,
                                                            const std::array<int, lanes>& body) {
  const double* const r0 = rotations[body[0]].data();
  const double* const r1 = rotations[body[1]].data();
  const double* const r2 = rotations[body[2]].data();
  const double* const r3 = rotations[body[3]].data();
  LaneMatrices result;
  for (int k = 0; k < 9; ++k) result.column[k / 3][k % 3] = Lanes{r0[k], r1[k], r2[k], r3[k]};
  return result;
}

/// R v, as Eigen sums it: the first two components together, the third by itself in another order.
[[gnu::always_inline]] inline LaneVectors turned(const LaneMatrices& r, const LaneVectors& v) {
  return {{r.column[0][0] * v[0] + r.column[1][0] * v[1] + r.column[2][0] * v[2],
           r.column[0][1] * v[0] + r.column[1][1] * v[1] + r.column[2][1] * v[2],
           r.column[0][2] * v[0] + (r.column[1][2] * v[1] + r.column[2][2] * v[2])}};
}

/// Rᵀ v.
[[gnu::always_inline]] inline LaneVectors turned_back(const LaneMatrices& r, const LaneVectors& v) {
  return {{dot(r.column[0], v), dot(r.column[1], v), dot(r.column[2], v)}};
}

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
  const Lanes gamma =
      dot(direction, direction) * at.inverse_mass + dot(local_a, response_a) + dot(local_b, response_b);
  row.inverse_gamma = choose(gamma > all(0), all(1) / gamma, all(0));
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

[[gnu::always_inline]] inline void formulate_lanes(ContactRow* rows, const ContactBatch& x,
                                                   const Formulation& from) {
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
  int next_friction = x.first + x.contacts;
  for (int i = 0; i < x.contacts; ++i) {
    const FourContacts contact{&from.contacts[x.source[0] + i], &from.contacts[x.source[1] + i],
                               &from.contacts[x.source[2] + i], &from.contacts[x.source[3] + i]};
    const LaneVectors arm_a = gather(contact, &Contact::arm_a);
    const LaneVectors arm_b = gather(contact, &Contact::arm_b);
    const Lanes bounce = gather(contact, &Contact::bounce);
    ContactRow& normal = rows[x.first + i];
    const Lanes gap =
        set_row(at, arm_a, arm_b, gather(contact, &Contact::normal_b), from.in_body_frames, normal);
    normal.beta = choose(bounce > all(0), bounce, -gap / all(from.hs));
    normal.position_share = choose(bounce > all(0), all(0), all(1));
    normal.friction = all(0);
    normal.normal = -1;
    if (contact[0]->friction == 0) continue;  // and the others' is, too
    for (const auto tangent : {&Contact::tangent_b1, &Contact::tangent_b2}) {
      ContactRow& row = rows[next_friction++];
      set_row(at, arm_a, arm_b, gather(contact, tangent), from.in_body_frames, row);
      row.beta = all(0);
      row.position_share = all(0);
      row.friction = gather(contact, &Contact::friction);
      row.normal = x.first + i;
    }
  }
}

using Solve = void(ContactRow*, const ContactBatch&, const RowSolve&, std::vector<Velocity>&, double*);

// The same operations with the vectors of every x86-64 and with wider ones, where the processor has them.
void solve_two_wide(ContactRow* rows, const ContactBatch& x, const RowSolve& how, std::vector<Velocity>& v,
                    double* moved) {
  moved ? solve_lanes<true>(rows, x, how, v, moved) : solve_lanes<false>(rows, x, how, v, moved);
}
[[gnu::target("avx2")]] void solve_four_wide(ContactRow* rows, const ContactBatch& x, const RowSolve& how,
                                             std::vector<Velocity>& v, double* moved) {
  moved ? solve_lanes<true>(rows, x, how, v, moved) : solve_lanes<false>(rows, x, how, v, moved);
}

void formulate_two_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts.rows.data(), x, from);
}
[[gnu::target("avx2")]] void formulate_four_wide(ContactBatches& contacts, const Formulation& from) {
  for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts.rows.data(), x, from);
}

/// Friction's β follows no coordinate, so only the normals are gone through.
[[gnu::always_inline]] inline void update_biases_lanes(ContactBatches& contacts,
                                                       const std::vector<Velocity>& v_local) {
  for (const ContactBatch& x : contacts.batches) {
    const Moving a = gather(v_local, x.a);
    const Moving b = gather(v_local, x.b);
    for (int r = x.first; r < x.first + x.contacts; ++r) {
      ContactRow& row = contacts.rows[r];
      row.beta -= row.position_share * row_velocity(row, a, b);
    }
  }
}
void update_biases_two_wide(ContactBatches& contacts, const std::vector<Velocity>& v_local) {
  update_biases_lanes(contacts, v_local);
}
[[gnu::target("avx2")]] void update_biases_four_wide(ContactBatches& contacts,
                                                     const std::vector<Velocity>& v_local) {
  update_biases_lanes(contacts, v_local);
}

[[gnu::always_inline]] inline void undo_update_rule_lanes(ContactBatches& contacts,
                                                          const std::vector<Velocity>& change) {
  for (const ContactBatch& x : contacts.batches) {
    const Moving a = gather(change, x.a);
    const Moving b = gather(change, x.b);
    for (int r = x.bounces ? x.first : x.first + x.contacts; r < x.first + x.count; ++r) {
      ContactRow& row = contacts.rows[r];
      row.beta += (all(1) - row.position_share) * row_velocity(row, a, b);
    }
  }
}
void undo_update_rule_two_wide(ContactBatches& contacts, const std::vector<Velocity>& change) {
  undo_update_rule_lanes(contacts, change);
}
[[gnu::target("avx2")]] void undo_update_rule_four_wide(ContactBatches& contacts,
                                                        const std::vector<Velocity>& change) {
  undo_update_rule_lanes(contacts, change);
}

/// As glibc sees it, so that its tunables can hide the instructions from a test.
bool is_four_wide() {
  static const bool answer = CPU_FEATURE_ACTIVE(AVX2);
  return answer;
}

}  // namespace

bool ContactBatches::Pair::fits(const Pair& other) const {
  return contacts <= most_mixed &&
         std::tie(level, contacts, friction) == std::tie(other.level, other.contacts, other.friction);
}

void ContactBatches::build(const Model& model, const std::vector<Contact>& contacts) {
  // There are at most as many pairs as contacts, and three rows a contact.
  pairs_.reserve(contacts.capacity());
  batches.reserve(contacts.capacity());
  rows.reserve(3 * contacts.capacity());
  pairs_.clear();
  batches.clear();
  depth_.assign(model.masses.size(), 0);
  const auto moves = [&model](int body) {
    return model.masses[body].inverse_mass > 0 || model.masses[body].inverse_inertia.maxCoeff() > 0;
  };
  row_count = 0;
  for (std::size_t begin = 0, end = 0; begin < contacts.size(); begin = end) {
    const int a = contacts[begin].a;
    const int b = contacts[begin].b;
    Pair pair{std::max(depth_[a], depth_[b]), 0, 0, static_cast<int>(begin)};
    while (end < contacts.size() && contacts[end].a == a && contacts[end].b == b) {
      const bool rubs = contacts[end].friction != 0;
      if (rubs) pair.friction |= std::uint64_t{1} << (pair.contacts % most_mixed);
      row_count += rubs ? 3 : 1;
      ++pair.contacts;
      ++end;
    }
    if (moves(a)) depth_[a] = pair.level + 1;
    if (moves(b)) depth_[b] = pair.level + 1;
    pairs_.push_back(pair);
  }
  std::ranges::sort(pairs_);

  int row = 0;
  for (std::size_t begin = 0, end = 0; begin < pairs_.size(); begin = end) {
    const Pair& first = pairs_[begin];
    ContactBatch x{};
    x.contacts = first.contacts;
    x.first = row;
    for (end = begin + 1; end < pairs_.size() && end - begin < lanes && pairs_[end].fits(first); ++end) {
    }
    x.pairs = static_cast<int>(end - begin);
    for (int lane = 0; lane < lanes; ++lane) {
      const int source = pairs_[lane < x.pairs ? begin + lane : begin].source;
      x.source[lane] = source;
      x.a[lane] = contacts[source].a;
      x.b[lane] = contacts[source].b;
      x.inverse_mass_a[lane] = model.masses[x.a[lane]].inverse_mass;
      x.inverse_mass_b[lane] = model.masses[x.b[lane]].inverse_mass;
    }
    row += x.contacts;
    for (int i = 0; i < x.contacts; ++i) row += contacts[first.source + i].friction != 0 ? 2 : 0;
    for (const int source : x.source) {
      for (int i = 0; i < x.contacts; ++i) x.bounces = x.bounces || contacts[source + i].bounce > 0;
    }
    x.count = row - x.first;
    batches.push_back(x);
  }
  rows.resize(row);
}

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  static Solve* const solve = is_four_wide() ? solve_four_wide : solve_two_wide;
  solve(contacts.rows.data(), x, how, v, moved);
}

void formulate(ContactBatches& contacts, const Model& model, const std::vector<Contact>& found,
               const std::vector<Coordinates>& q, const std::vector<Matrix3>& rotations, bool in_body_frames,
               double hs) {
  const Formulation from{model, found, q, rotations, in_body_frames, hs};
  is_four_wide() ? formulate_four_wide(contacts, from) : formulate_two_wide(contacts, from);
}

void clear_impulses(ContactBatches& contacts) {
  for (ContactRow& row : contacts.rows) row.impulse = all(0);
}

void update_biases(ContactBatches& contacts, const std::vector<Velocity>& v_local) {
  is_four_wide() ? update_biases_four_wide(contacts, v_local) : update_biases_two_wide(contacts, v_local);
}

void box_biases(ContactBatches& contacts, double kappa, double tau) {
  for (ContactRow& row : contacts.rows) row.beta *= all(tau / kappa);
}

void undo_update_rule(ContactBatches& contacts, const std::vector<Velocity>& change) {
  is_four_wide() ? undo_update_rule_four_wide(contacts, change) : undo_update_rule_two_wide(contacts, change);
}

}  // namespace substep
