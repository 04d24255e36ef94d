// AVBD: augmented vertex block descent for rigid bodies. Neither from the report nor derived from it: Chris
// Giles, Elie Diaz, Cem Yuksel, "Augmented Vertex Block Descent", ACM Transactions on Graphics 44(4), 2025.
// Written from the paper.
//
// | step    | what                                                                        | in the paper       |
// |---------|-----------------------------------------------------------------------------|--------------------|
// | rows    | forces decay by α γ, penalties by γ                                         | (19)               |
// | predict | inertial coordinates                                                        | (2)                |
// | primal  | body by body: 6 × 6 system of inertia and all its penalties, Δq = −H⁻¹ ∇E    | (4) to (6), (13),  |
// |         | with the geometric stiffness of ball joints as a diagonal                    | (17), section 3.5  |
// | dual    | λ ← clamp(λ − k C); k grows by β |C| where the force is within its limits    | (11), (16)         |
// | finish  | v = Δq/h                                                                     |                    |
//
// Defaults are those of the authors' demo in three dimensions: ten iterations, α = 0.99, β = 10⁴ N/m²
// (angular rows 10²), γ = 0.999, penalties from 1 to 10¹⁰. Differences: contacts have no margin, since
// separate bodies are not held back; the initial guess is the motion without gravity; joints' angular rows
// have no torque arm; nothing bounces. λ is the force on body a, the paper's sign is the opposite. Row solves
// count each row once per iteration, though three updates read it.

#include "sim/descendants/descendants.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "sim/math/rotation.h"

namespace substep {
namespace {

constexpr double gamma = 0.999;
constexpr double least_penalty = 1;
constexpr double largest_penalty = 1e10;
constexpr double angular_growth = 0.01;     // of angular rows' β, relative to that of linear rows
constexpr double sticking_distance = 1e-5;  // m
constexpr double least_inverse = 1e-30;     // of bodies that do not move or turn, 1/kg and 1/(kg m²)

/// Returns the rotation vector from one orientation to another, in the frame of `from`.
Vector3 turn(const Quaternion& from, const Quaternion& to) {
  return rotation_vector(from.conjugate() * to);
}

double decayed(double penalty) {
  return std::clamp(gamma * penalty, least_penalty, largest_penalty);
}

/// Returns the part of the violation C at a step's start that the step corrects: (1 − α) C, or all of a gap.
double start_value(double value, bool is_one_sided, double alpha) {
  return is_one_sided && value > 0 ? value : (1 - alpha) * value;
}

/// Returns a joint's row of the step's start as a constraint. `force`, `penalty`: of the last step.
AvbdRow row_of(const Row& row, const Block& x, double h, const Settings& settings, double force,
               double penalty) {
  AvbdRow result{.j = row,
                 .value = -h * row.beta,
                 .force = settings.alpha * gamma * force,
                 .penalty = decayed(penalty),
                 .stiffness = infinity,
                 .growth = settings.beta,
                 .low = row.low / h,
                 .high = row.high / h};
  if (row.linear.isZero(0)) result.growth *= angular_growth;
  if (row.softness > 0) {  // λ h softness = β − J v: springs and dampers keep their stiffness
    result.force = 0;
    result.penalty = result.stiffness = 1 / (row.softness * h * h);
  } else if (x.stabilized && x.positional_bias_fraction > 0) {
    result.value = start_value(result.value, row.low == 0, settings.alpha);
  }
  return result;
}

/// Adds a contact's normal and tangents as constraints, with J at the step's start (section 4).
void add_contact(const Contact& contact, const Problem& problem, const std::vector<Coordinates>& q,
                 const Settings& settings, AvbdWork& work) {
  const Matrix3& rotation_a = problem.rotations[contact.a];
  const Matrix3& rotation_b = problem.rotations[contact.b];
  const Vector3 apart =
      q[contact.a].linear + rotation_a * contact.arm_a - q[contact.b].linear - rotation_b * contact.arm_b;
  work.blocks.push_back({contact.a, contact.b, static_cast<int>(work.rows.size()), 3, -1, contact.friction});
  const double displacement[3] = {0, contact.displacement_1, contact.displacement_2};
  for (int k = 0; k < 3; ++k) {
    const Jacobian row = contact_jacobian(contact, problem, k);
    const double gap = k == 0 ? row.linear.dot(apart) + contact.gap_offset : displacement[k];
    work.rows.push_back({row, start_value(gap, k == 0, settings.alpha),
                         settings.alpha * gamma * contact.force[k], decayed(contact.stiffness[k]), infinity,
                         settings.beta, k == 0 ? 0 : -infinity, infinity});
  }
}

/// Lists the indices of each body's blocks, ascending.
void list_blocks(std::size_t bodies, AvbdWork& work) {
  work.begins.assign(bodies + 1, 0);
  for (const AvbdBlock& x : work.blocks) {
    ++work.begins[x.a];
    ++work.begins[x.b];
  }
  for (std::size_t i = 1; i <= bodies; ++i) work.begins[i] += work.begins[i - 1];
  work.blocks_of.resize(work.begins[bodies]);
  for (int i = static_cast<int>(work.blocks.size()) - 1; i >= 0; --i) {
    work.blocks_of[--work.begins[work.blocks[i].a]] = i;
    work.blocks_of[--work.begins[work.blocks[i].b]] = i;
  }
}

/// Updates J of a lock's or limit's rows to the current coordinates. Returns C, linearised for other blocks.
Impulse update(Problem& problem, const std::vector<Coordinates>& q, double h, AvbdWork& work,
               const AvbdBlock& x) {
  Impulse value{};
  Constraints& c = problem.c;
  const bool is_followed = x.joint >= 0 && c.blocks[x.joint].stabilized;
  if (is_followed) {
    Block& block = c.blocks[x.joint];
    formulate_block(problem, block,
                    {q[x.a], q[x.b], q[x.a].angular.toRotationMatrix(), q[x.b].angular.toRotationMatrix()},
                    h);
  }
  for (int k = 0; k < x.rows; ++k) {
    AvbdRow& row = work.rows[x.first + k];
    if (!is_followed) {
      value[k] = row.value + row_velocity(row.j, work.displacement[x.a], work.displacement[x.b]);
      continue;
    }
    // Add C now to row.value, which is −α C of the step's start: the step leaves that part uncorrected.
    const Row& now = c.rows[c.blocks[x.joint].first + k];
    row.j = static_cast<const Jacobian&>(now);
    value[k] = row.value - h * now.beta;
  }
  return value;
}

/// Returns the clamped forces λ − k C, friction's inside the cone of the normal force (section 3.2). `holds`
/// becomes true where friction was inside.
Impulse forces_of(const AvbdWork& work, const AvbdBlock& x, const Impulse& value, bool* holds = nullptr) {
  Impulse force{};
  for (int k = 0; k < x.rows; ++k) {
    const AvbdRow& row = work.rows[x.first + k];
    force[k] = std::clamp(row.force - row.penalty * value[k], row.low, row.high);
  }
  if (x.joint >= 0) return force;
  const double limit = x.friction * force[0];
  const double size = std::sqrt(force[1] * force[1] + force[2] * force[2]);
  if (holds) *holds = size <= limit;
  if (size > limit) {
    force[1] *= limit / size;
    force[2] *= limit / size;
  }
  return force;
}

/// Returns a row's penalty. A spring or damper at its limit has the penalty that gives its force at C: with
/// its full stiffness the body would hardly move, and with none it would overshoot.
double penalty_at(const AvbdRow& row, double force, double value) {
  const bool yields = row.stiffness < infinity && (force == row.low || force == row.high) && value != 0;
  return yields ? std::abs(force / value) : row.penalty;
}

/// Adds a block's penalties and forces to a body's system.
void add_to_system(const Problem& problem, const AvbdWork& work, const AvbdBlock& x, const Impulse& value,
                   const Impulse& force, int body, Matrix6& lhs, Vector6& rhs) {
  const double sign = body == x.a ? 1 : -1;
  Vector3 push = Vector3::Zero();
  for (int k = 0; k < x.rows; ++k) {
    const AvbdRow& row = work.rows[x.first + k];
    Vector6 j;
    j << sign * row.j.linear, (body == x.a ? row.j.angular_a : row.j.angular_b);
    lhs += (penalty_at(row, force[k], value[k]) * j) * j.transpose();
    rhs += force[k] * j;
    push += sign * force[k] * row.j.linear;
  }
  if (x.joint < 0 || problem.c.blocks[x.joint].kind != Block::Kind::lock) return;
  const Lock& lock = problem.model->locks[problem.c.blocks[x.joint].source];
  if (lock.kind != Lock::Kind::point) return;
  // Add the column lengths of the second derivative of R r · F: (r Fᵀ − (r · F) 1) in the body's frame.
  const Vector3& arm = body == x.a ? lock.at.frame_a.position : lock.at.frame_b.position;
  const Vector3 in_body = problem.rotations[body].transpose() * push;
  const Matrix3 second = arm * in_body.transpose() - arm.dot(in_body) * Matrix3::Identity();
  for (int k = 0; k < 3; ++k) lhs(3 + k, 3 + k) += second.col(k).norm();
}

/// Makes the rows of joints and contacts, with the forces and penalties of the last step decayed. (19)
void make_rows(const std::vector<Coordinates>& q, const Settings& settings, Problem& problem,
               const std::vector<double>& start, AvbdWork& work) {
  const double h = settings.step;
  Constraints& c = problem.c;
  work.rows.clear();
  work.blocks.clear();
  const std::size_t most_contacts = problem.contacts->capacity();
  work.rows.reserve(c.rows.size() + 3 * most_contacts);
  work.blocks.reserve(c.blocks.size() + most_contacts);
  work.blocks_of.reserve(2 * work.blocks.capacity());
  work.sticks.reserve(work.blocks.capacity());
  problem.substeps.part = 1;  // so that −h β is all of a gap
  formulate(problem, q, h);
  const bool is_known = start.size() == 2 * c.rows.size();
  for (std::size_t i = 0; i < c.blocks.size(); ++i) {
    const Block& x = c.blocks[i];
    work.blocks.push_back({x.a, x.b, static_cast<int>(work.rows.size()), x.rows, static_cast<int>(i), 0});
    for (int k = x.first; k < x.first + x.rows; ++k) {
      work.rows.push_back(row_of(c.rows[k], x, h, settings, is_known ? start[k] : 0,
                                 is_known ? start[c.rows.size() + k] : least_penalty));
      // Keep −α times the violation at the start: update() adds C at the current coordinates.
      if (x.stabilized) work.rows.back().value += h * c.rows[k].beta;
    }
  }
  for (const Contact& contact : *problem.contacts) add_contact(contact, problem, q, settings, work);
  list_blocks(q.size(), work);
  work.sticks.assign(work.blocks.size(), 0);
}

/// Moves the bodies to where they go without gravity, and computes the inertial coordinates. (2)
void predict(double h, Problem& problem, std::vector<Coordinates>& q, std::vector<Velocity>& v,
             AvbdWork& work) {
  const std::vector<Coordinates>& begin = problem.substeps.stepped;  // q when the step begins
  work.displacement.resize(q.size());
  set_zero(work.displacement);
  work.inertial = q;
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += h * v[i].linear;
    q[i].angular = compose(q[i].angular, rotation_quaternion(h * v[i].angular));
    problem.rotations[i] = q[i].angular.toRotationMatrix();
    work.displacement[i] = {q[i].linear - begin[i].linear, h * v[i].angular};
  }
  add_external(problem, h, v);
  step_coordinates(h, v, work.inertial);
}

/// Moves a body to the minimum of its energy. (4)
void update_body(int i, double h, Problem& problem, std::vector<Coordinates>& q, AvbdWork& work) {
  const BodyMass& mass = problem.model->masses[i];
  const Coordinates& begin = problem.substeps.stepped[i];
  Matrix6 lhs = Matrix6::Zero();  // (5), (6)
  Vector6 rhs;
  lhs.diagonal() << Vector3::Constant(1 / (std::max(mass.inverse_mass, least_inverse) * h * h)),
      mass.inverse_inertia.cwiseMax(least_inverse).cwiseInverse() / (h * h);
  rhs << q[i].linear - work.inertial[i].linear, turn(work.inertial[i].angular, q[i].angular);
  rhs.array() *= -lhs.diagonal().array();
  for (int k = work.begins[i]; k < work.begins[i + 1]; ++k) {
    const AvbdBlock& x = work.blocks[work.blocks_of[k]];
    const Impulse value = update(problem, q, h, work, x);
    add_to_system(problem, work, x, value, forces_of(work, x, value), i, lhs, rhs);  // (13), (17)
  }
  const Vector6 change = lhs.llt().solve(rhs);
  q[i].linear += change.head<3>();
  q[i].angular = compose(q[i].angular, rotation_quaternion(change.tail<3>()));
  problem.rotations[i] = q[i].angular.toRotationMatrix();
  work.displacement[i] = {q[i].linear - begin.linear, turn(begin.angular, q[i].angular)};
}

/// Updates the forces and penalties of all blocks.
void update_forces(double h, Problem& problem, const std::vector<Coordinates>& q, AvbdWork& work) {
  for (std::size_t i = 0; i < work.blocks.size(); ++i) {
    const AvbdBlock& x = work.blocks[i];
    const Impulse value = update(problem, q, h, work, x);
    bool holds = true;
    const Impulse force = forces_of(work, x, value, &holds);
    for (int k = 0; k < x.rows; ++k) {
      AvbdRow& row = work.rows[x.first + k];
      if (row.stiffness < infinity) continue;
      row.force = force[k];  // (11)
      const bool is_within = force[k] > row.low && force[k] < row.high && (k == 0 || holds);
      if (is_within)
        row.penalty = std::min(row.penalty + row.growth * std::abs(value[k]), largest_penalty);  // (16)
    }
    const double slip = std::sqrt(value[1] * value[1] + value[2] * value[2]);
    work.sticks[i] = holds && slip < sticking_distance ? 1 : 0;
  }
}

/// Stores the forces and penalties for the next step.
void carry(double h, const Problem& problem, const AvbdWork& work, CarriedForces& carried) {
  const Constraints& c = problem.c;
  carried.contacts.clear();
  carried.contacts.reserve(problem.contacts->capacity());
  carried.joints.resize(2 * c.rows.size());
  for (std::size_t i = 0; i < c.blocks.size(); ++i) {
    for (int k = 0; k < c.blocks[i].rows; ++k) {
      const int row = c.blocks[i].first + k;
      carried.joints[row] = work.rows[work.blocks[i].first + k].force;
      carried.joints[c.rows.size() + row] = work.rows[work.blocks[i].first + k].penalty;
    }
  }
  for (std::size_t i = c.blocks.size(); i < work.blocks.size(); ++i) {
    const AvbdBlock& x = work.blocks[i];
    const AvbdRow* const rows = &work.rows[x.first];
    const Vector3 force(rows[0].force, rows[1].force, rows[2].force);
    Vector3 displacement = Vector3::Zero();
    const Contact& contact = (*problem.contacts)[i - c.blocks.size()];
    for (int k = 1; k < 3 && work.sticks[i] != 0; ++k) {
      displacement[k] = (k == 1 ? contact.displacement_1 : contact.displacement_2) +
                        row_velocity(rows[k].j, work.displacement[x.a], work.displacement[x.b]);
    }
    const Vector3 penalties(rows[0].penalty, rows[1].penalty, rows[2].penalty);
    carried.contacts.push_back({h * force, force, penalties, displacement});
  }
}

}  // namespace

std::int64_t avbd(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
                  Problem& problem, const std::vector<double>& start, AvbdWork& work,
                  CarriedForces& carried) {
  const double h = settings.step;
  const Model& model = *problem.model;
  const int bodies = static_cast<int>(q.size());
  make_rows(q, settings, problem, start, work);
  predict(h, problem, q, v_local, work);
  for (int iteration = 0; iteration < settings.iterations; ++iteration) {
    // Primal update: move the bodies one after the other.
    for (int i = 1; i < bodies; ++i) {
      if (moves(model.masses[i])) update_body(i, h, problem, q, work);
    }
    // Dual update: adapt forces and penalties.
    update_forces(h, problem, q, work);
  }
  // Finish: derive velocities from displacements.
  for (int i = 1; i < bodies; ++i) {
    if (!moves(model.masses[i])) continue;
    v_local[i] = {work.displacement[i].linear / h, work.displacement[i].angular / h};
  }
  carry_momenta(problem, h, v_local);
  carry(h, problem, work, carried);
  return settings.iterations * std::ssize(work.rows);
}

}  // namespace substep
