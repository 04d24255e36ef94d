// Builds a step's contacts. Updates coordinates, velocities and biases between sub-steps.

#include <algorithm>

#include "sim/constraints/formulate.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// Returns coordinates advanced by `duration`; angular velocities are in the bodies' frames.
Coordinates ahead(const Coordinates& q, const Velocity& v_local, double duration) {
  return {q.linear + duration * v_local.linear,
          compose(q.angular, rotation_quaternion(duration * v_local.angular))};
}

/// Applies the impulses of a warm start to a block's bodies.
void apply_warm_start(const Constraints& c, const Block& x, double scale, std::vector<Velocity>& v) {
  apply(c, x, impulse_of(c, x), v, scale);
}

/// Returns true where bodies hit a rigid one-sided limit in the sub-step, at twice the speed that gravity
/// gives them in it or more. `sum_v`: A5's sum of velocities, which β includes, else null.
bool hits_limit(const Problem& problem, const Block& x, const std::vector<Velocity>& v,
                const std::vector<Velocity>* sum_v) {
  const Row& row = problem.c.rows[x.first];
  if (x.kind != Block::Kind::limit || !x.stabilized || row.low < 0) return false;
  const double approach = -row_velocity(row, v[x.a], v[x.b]);
  const double followed = sum_v ? row_velocity(row, (*sum_v)[x.a], (*sum_v)[x.b]) : 0;
  const double beta = (row.beta - followed) / problem.c.bias_scale;
  // β = −room/hs. With τ < 1 the row brakes before the room is closed, so count one sub-step more.
  // Without gravity, bodies at rest at their bound would hit it by rounding alone.
  const auto speed = [](const Velocity& body, const Vector3& angular) {
    return body.linear.norm() + angular.norm() * body.angular.norm();
  };
  const double rounding = 1e-9 * (speed(v[x.a], row.angular_a) + speed(v[x.b], row.angular_b));
  if (approach <= rounding || 2 * approach + beta < 0) return false;
  // A stop that a drive presses was passed a sub-step ago: β >= approach.
  const auto presses = [&](const Drive& drive) { return drive.at.a == x.a && drive.at.b == x.b; };
  if (2 * beta > approach && std::ranges::any_of(problem.model->drives, presses)) return false;
  // Compare energies, so that angles and lengths have one rule.
  const double gained = 2 * problem.substeps.duration * problem.model->gravity.norm();
  return approach * approach * row.effective_mass * (x.inverse_mass_a + x.inverse_mass_b) > gained * gained;
}

/// Lets a one-sided spring with a damper act where its bound is passed within the step. `followed`: A5's
/// J sv, which β includes.
void engage_spring(const Problem& problem, Block& x, Row& row, double followed) {
  if (x.kind != Block::Kind::limit || x.stabilized || x.positional_bias_fraction < 1) return;
  const Limit& limit = problem.model->limits[x.source];
  const double passed = row.beta - followed;
  if (limit.damping == 0 || passed <= 0) return;
  const double elastic = problem.substeps.duration * limit.stiffness;
  x.positional_bias_fraction = elastic / (elastic + limit.damping);
  row.beta = followed + x.positional_bias_fraction * passed;
}

/// Returns the angular velocity at the start of a (sub-)step whose impulses change the mean to `mean`.
Vector3 start_of(const FreeRotation& free, const Vector3& mean) {
  return mean - (free.mean - free.start);
}

/// Returns the angular velocity, in its frame, of the k-th gyroscopic body at the end of a (sub-)step with
/// the mean angular velocity `mean`.
Vector3 velocity_at_end(const Problem& problem, std::size_t k, double duration, const Vector3& mean) {
  const Vector3& inertia = problem.model->inertia[problem.model->gyroscopic[k]];
  const Vector3 momentum = inertia.cwiseProduct(start_of(problem.substeps.free_rotations[k], mean));
  return velocity_after_turn(momentum, inertia, duration * mean);
}

}  // namespace

void build_contacts(Problem& problem, const std::vector<Coordinates>& q) {
  std::vector<PatchShape> none;
  problem.c.contacts.build(*problem.model, *problem.contacts,
                           problem.kept_patches ? *problem.kept_patches : none, q);
}

void update_stable(Problem& problem, Block& x, const std::vector<Velocity>& v_hat,
                   const std::vector<Velocity>* sum_v) {
  if (!x.stable) return;
  const Substeps& substeps = problem.substeps;
  const auto next_frame = [&](int body) {
    Velocity v = v_hat[body];
    if (sum_v) {
      v.linear -= (*sum_v)[body].linear;
      v.angular -= (*sum_v)[body].angular;
    }
    v.linear += substeps.offset[body].linear;
    v.angular += substeps.offset[body].angular;
    return ahead(substeps.stepped[body], v, substeps.duration);
  };
  const Coordinates a = next_frame(x.a);
  const Coordinates b = next_frame(x.b);
  Impulse beta{};
  const std::span<Row> rows = problem.c.rows_of(x);
  for (int k = 0; k < x.rows; ++k) beta[k] = rows[k].beta;
  formulate_block(problem, x, {a, b, a.angular.toRotationMatrix(), b.angular.toRotationMatrix()},
                  substeps.duration);
  for (int k = 0; k < x.rows; ++k) {
    if (substeps.bias_at_next_frame) {
      // Take one Newton step on C(q + hs v') = 0 from v̂: J̆ v' = J̆ v̂ − C(q + hs v̂)/hs. A damper's
      // fraction of β has no C.
      rows[k].beta += x.positional_bias_fraction * row_velocity(rows[k], v_hat[x.a], v_hat[x.b]);
    } else {
      rows[k].beta = beta[k];
    }
  }
}

void add_external(Problem& problem, double duration, std::vector<Velocity>& v_local) {
  const Model& model = *problem.model;
  const Vector3 fall = duration * model.gravity;
  for (std::size_t i = 0; i < v_local.size(); ++i) {
    if (model.masses[i].inverse_mass > 0) v_local[i].linear += model.masses[i].gravity_factor * fall;
  }
  for (std::size_t k = 0; k < model.gyroscopic.size(); ++k) {
    const int i = model.gyroscopic[k];
    Vector3& v = v_local[i].angular;
    if (model.has_joints[i]) {
      v += implicit_gyroscopic_change(v, model.inertia[i], duration);
      continue;
    }
    problem.substeps.free_rotations[k] = {v, mean_of_free_rotation(v, model.inertia[i], duration)};
    v = problem.substeps.free_rotations[k].mean;
  }
}

void renew_free_rotation(Problem& problem, double duration, std::vector<Velocity>& v_local) {
  constexpr double negligible = 1e-6;  // rad
  const Model& model = *problem.model;
  for (std::size_t k = 0; k < model.gyroscopic.size(); ++k) {
    const int i = model.gyroscopic[k];
    if (model.has_joints[i]) continue;
    FreeRotation& free = problem.substeps.free_rotations[k];
    Vector3& v = v_local[i].angular;
    const Vector3 start = start_of(free, v);
    // Leave means of which the turn errs by less than `negligible`.
    if (duration * duration * (v - free.mean).norm() * start.norm() < negligible) continue;
    v = mean_of_free_rotation(start, model.inertia[i], duration);
    free = {start, v};
  }
}

void carry_momenta(const Problem& problem, double duration, std::vector<Velocity>& v_local) {
  for (std::size_t k = 0; k < problem.model->gyroscopic.size(); ++k) {
    const int i = problem.model->gyroscopic[k];
    if (problem.model->has_joints[i]) continue;
    v_local[i].angular = velocity_at_end(problem, k, duration, v_local[i].angular);
  }
}

void carry_momenta(const Problem& problem, double duration, const std::vector<Coordinates>& q,
                   std::vector<Velocity>& v) {
  for (std::size_t k = 0; k < problem.model->gyroscopic.size(); ++k) {
    const int i = problem.model->gyroscopic[k];
    if (problem.model->has_joints[i]) continue;
    const Vector3 local = problem.rotations[i].transpose() * v[i].angular;
    v[i].angular = q[i].angular * velocity_at_end(problem, k, duration, local);
  }
}

void to_local(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) v[i].angular = (rotations[i].transpose() * v[i].angular).eval();
}

void to_world(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v) {
  for (std::size_t i = 1; i < v.size(); ++i) v[i].angular = (rotations[i] * v[i].angular).eval();
}

void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q) {
  for (std::size_t i = 1; i < q.size(); ++i) q[i] = ahead(q[i], v_local[i], hs);
}

void start_substep(Problem& problem, std::vector<Velocity>& v, const std::vector<Velocity>* sum_v) {
  Constraints& c = problem.c;
  const auto [fraction, joint_scale, contact_scale] = problem.warm_start;
  ++c.limits_of;
  c.is_limit_hit =
      std::ranges::any_of(c.blocks, [&](const Block& x) { return hits_limit(problem, x, v, sum_v); });
  for (Row& row : c.rows) {
    row.earlier += row.impulse;
    row.impulse = fraction > 0 ? fraction * row.impulse : 0;
  }
  start_substep(c.contacts, problem.substeps.duration, v, problem.substeps.offset, sum_v);
  if (fraction == 0) return;
  for (const Block& x : c.blocks) apply_warm_start(c, x, joint_scale, v);
  warm_start(c.contacts, fraction, contact_scale, v);
}

int sweeps_of(const Problem& problem, int m) {
  // Five touching balls transmit a bounce in 20 sweeps. A hinged plank that is hit at its end turns as it
  // should, to 0.1 %, in 4.
  constexpr int sweeps_of_bounce = 30;
  constexpr int sweeps_of_jointed_impact = 8;
  if (problem.c.contacts.bounces) return std::max(m, sweeps_of_bounce);
  const bool joints_transmit =
      problem.c.is_limit_hit || (problem.c.contacts.has_impact && !problem.c.blocks.empty());
  return joints_transmit ? std::max(m, sweeps_of_jointed_impact) : m;
}

void update_biases(Problem& problem, const std::vector<Velocity>& v_local) {
  Constraints& c = problem.c;
  for (Block& x : c.blocks) {
    if (x.positional_bias_fraction == 0) continue;
    for (Row& row : c.rows_of(x)) {
      row.beta -= x.positional_bias_fraction * row_velocity(row, v_local[x.a], v_local[x.b]);
      engage_spring(problem, x, row, 0);
    }
  }
  add_to_biases(c.contacts, -1, v_local);
  release_sliding(c.contacts, problem.substeps.duration, nullptr, problem.substeps.offset);
}

void box_biases(Constraints& c, const Settings& settings) {
  c.bias_scale = settings.tau / settings.kappa;
  for (const Block& x : c.blocks) {
    if (!x.stabilized) continue;
    for (Row& row : c.rows_of(x)) row.beta *= c.bias_scale;
  }
  box_biases(c.contacts, settings.of_contacts());
}

void undo_update_rule(Problem& problem, const Settings& settings, const std::vector<Velocity>& v_local,
                      const std::vector<Velocity>& sum_v) {
  Constraints& c = problem.c;
  Substeps& substeps = problem.substeps;
  const auto [n, m, tau, kappa] = settings.substepping();
  const auto [contact_tau, contact_kappa] = settings.of_contacts();
  const bool contacts_differ = contact_tau * kappa != tau * contact_kappa;
  if (contacts_differ || !c.blocks.empty()) scale(tau / kappa, v_local, substeps.change);
  for (Block& x : c.blocks) {
    // A row that is not stabilized follows v̆ by its positional fraction, not (τ/κ) v̆.
    const double undone = 1 - x.positional_bias_fraction * (x.stabilized ? 1 : kappa / tau);
    if (undone == 0 && x.stabilized) continue;
    for (Row& row : c.rows_of(x)) {
      row.beta += undone * row_velocity(row, substeps.change[x.a], substeps.change[x.b]);
      engage_spring(problem, x, row, row_velocity(row, sum_v[x.a], sum_v[x.b]));
    }
  }
  if (contacts_differ)
    add_to_biases(c.contacts, 1 - contact_tau / contact_kappa * (kappa / tau), substeps.change);
  release_sliding(c.contacts, substeps.duration, &sum_v, substeps.offset);
}

}  // namespace substep
