#include "sim/measure/constrained_dynamics.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace substep {
namespace {

double effective_mass(const Block& x, const Row& row) {
  const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                       row.angular_a.dot(row.response_a) + row.angular_b.dot(row.response_b);
  return gamma > 0 ? 1 / gamma : 0;
}

void push(const Block& x, const Row& row, double force, VelocityVector& v) {
  Velocity& a = v[x.a];
  Velocity& b = v[x.b];
  a.linear += row.linear * (x.inverse_mass_a * force);
  a.angular += row.response_a * force;
  b.linear -= row.linear * (x.inverse_mass_b * force);
  b.angular += row.response_b * force;
}

/// Without its one-sided limits, and what is a force.
Model rigid_part(const Model& model) {
  Model rigid = model;
  rigid.limits.clear();
  rigid.drives.clear();
  for (const Limit& limit : model.limits) {
    if (!limit.soft && limit.side == Limit::Side::both) rigid.limits.push_back(limit);
  }
  return rigid;
}

/// Its springs and drives alone.
Model force_part(const Model& model) {
  Model forces = model;
  forces.locks.clear();
  forces.limits.clear();
  for (const Limit& limit : model.limits) {
    if (limit.soft) forces.limits.push_back(limit);
  }
  return forces;
}

}  // namespace

void RowSolver::solve(const Mlcp& problem) {
  MlcpReport report;
  if (joints_.solve(problem, lambda_, report) && report.status == MlcpReport::Status::solved) {
    impulses_ = joints_.impulses();
    return;
  }
  const auto rows = static_cast<Eigen::Index>(problem.rows.size());
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(rows, 6 * problem.bodies);
  Eigen::VectorXd right(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Mlcp::Row& row = problem.rows[i];
    if (row.a >= 0) g.block<1, 6>(i, 6 * row.a) += row.part_a.transpose();
    if (row.b >= 0) g.block<1, 6>(i, 6 * row.b) += row.part_b.transpose();
    right[i] = row.right;
  }
  const Eigen::VectorXd y = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(g).solve(right);
  const Eigen::VectorXd lambda =
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(g.transpose()).solve(y);
  lambda_.assign(lambda.begin(), lambda.end());
  impulses_.resize(problem.bodies);
  for (int body = 0; body < problem.bodies; ++body) impulses_[body] = y.segment<6>(6 * body);
}

ConstrainedDynamics::ConstrainedDynamics(const Model& model, double size)
    : size_(size),
      rigid_model_(rigid_part(model)),
      force_model_(force_part(model)),
      two_sided_(rigid_model_.limits.size()),
      drive_sides_(model.drives.size()),
      jacobian_rate_(rigid_model_, size) {
  hold({});
}

void ConstrainedDynamics::hold(const std::vector<Limit>& bounds) {
  rigid_model_.limits.resize(two_sided_);
  for (const Limit& bound : bounds) {
    rigid_model_.limits.push_back(bound);
    rigid_model_.limits.back().side = Limit::Side::both;
  }
  for (auto [problem, model] : {std::pair(&rigid_, &rigid_model_), std::pair(&force_, &force_model_)}) {
    problem->model = model;
    problem->contacts = &no_contacts_;
    build_blocks(*problem, Joints::rows);
  }
  jacobian_rate_.set_up(rigid_);
  place_.clear();
  redundant_rows_ = 0;
}

void ConstrainedDynamics::choose_rows(const CoordinateVector& q, double tolerance) {
  place_.clear();
  redundant_rows_ = 0;
  if (rigid_.c.blocks.empty()) return;
  formulate(rigid_, q, 1);
  change_.resize(q.size());
  set_zero(change_);
  make_mlcp(rigid_, change_, mlcp_);
  const auto rows = static_cast<Eigen::Index>(mlcp_.rows.size());
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6) * mlcp_.bodies, rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Mlcp::Row& row = mlcp_.rows[i];
    if (row.a >= 0) directions.col(i).segment<6>(6 * row.a) += row.part_a;
    if (row.b >= 0) directions.col(i).segment<6>(6 * row.b) += row.part_b;
    directions.col(i).normalize();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factored(directions);
  factored.setThreshold(tolerance);
  const Eigen::Index rank = factored.rank();
  if (rank == rows) return;
  place_.assign(rows, -1);
  for (Eigen::Index k = 0; k < rank; ++k) place_[factored.colsPermutation().indices()[k]] = 0;
  int next = 0;
  for (int& place : place_) {
    if (place == 0) place = next++;
  }
  redundant_rows_ = static_cast<int>(rows) - next;
}

double ConstrainedDynamics::lambda_of(int row) const {
  if (place_.empty()) return solver_.lambda()[row];
  return place_[row] < 0 ? 0 : solver_.lambda()[place_[row]];
}

std::vector<double> ConstrainedDynamics::pushes(const CoordinateVector& q, const VelocityVector& v) {
  std::vector<double> all(rigid_model_.limits.size());
  accelerate(q, v);
  for (const Block& x : rigid_.c.blocks) {
    if (x.kind == Block::Kind::limit) all[x.source] = lambda_of(x.first);
  }
  return {all.begin() + static_cast<std::ptrdiff_t>(two_sided_), all.end()};
}

std::vector<int> ConstrainedDynamics::drive_sides_at(const CoordinateVector& q, const VelocityVector& v) {
  std::vector<int> sides(force_model_.drives.size());
  if (sides.empty()) return sides;
  formulate(force_, q, 1);
  for (const Block& x : force_.c.blocks) {
    if (x.kind == Block::Kind::drive) sides[x.source] = side_of(x, v);
  }
  return sides;
}

double ConstrainedDynamics::violation(const CoordinateVector& q) {
  formulate(rigid_, q, 1);
  double furthest = 0;
  for (const Row& row : rigid_.c.rows) furthest = std::max(furthest, std::abs(row.beta));
  return furthest;
}

const VelocityVector& ConstrainedDynamics::accelerate(const CoordinateVector& q, const VelocityVector& v) {
  acceleration_.resize(v.size());
  set_zero(acceleration_);
  const Model& model = rigid_model_;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (model.masses[i].inverse_mass > 0)
      acceleration_[i].linear = model.masses[i].gravity_factor * model.gravity;
  }
  for (const int i : model.gyroscopic) {
    const Vector3& spin = v[i].angular;
    const BodyMass& mass = model.masses[i];
    const Vector3 momentum = model.inertia[i].cwiseProduct(spin);
    acceleration_[i].angular = mass.inverse_inertia.cwiseProduct(momentum.cross(spin));
  }
  if (!force_.c.blocks.empty()) add_forces(q, v);
  if (rigid_.c.blocks.empty()) return acceleration_;
  formulate(rigid_, q, 1);
  const std::vector<double>& terms = jacobian_rate_.terms(rigid_, q, v);
  for (const Block& x : rigid_.c.blocks) rigid_.c.rows[x.first].beta = -terms[x.first];
  respond(acceleration_);
  return acceleration_;
}

void ConstrainedDynamics::project(CoordinateVector& q, VelocityVector& v) {
  if (rigid_.c.blocks.empty()) return;
  for (int i = 0; i < 4; ++i) {
    const double furthest = violation(q);
    if (!(furthest > 1e-15 * size_)) break;
    change_.resize(v.size());
    set_zero(change_);
    respond(change_);
    step_coordinates(1, change_, q);
    if (furthest < 1e-8 * size_) break;  // what is left is its square
  }
  for (Row& row : rigid_.c.rows) row.beta = 0;
  respond(v);
}

void ConstrainedDynamics::add_forces(const CoordinateVector& q, const VelocityVector& v) {
  formulate(force_, q, 1);
  for (const Block& x : force_.c.blocks) {
    const Row& row = force_.c.rows[x.first];
    double force = 0;
    if (x.kind == Block::Kind::drive) {
      const Drive& drive = force_model_.drives[x.source];
      const int side = drive_sides_[x.source];
      force = side == 0 ? drive_force(x, v) : side * drive.max_force;
      if (drive.per_mass) force *= effective_mass(x, row);
    } else {
      const Limit& limit = force_model_.limits[x.source];
      const bool both = limit.side == Limit::Side::both;
      if (both || row.beta >= 0) {
        force =
            row.beta * (limit.stiffness + limit.damping) - limit.damping * row_velocity(row, v[x.a], v[x.b]);
      }
      if (!both) force = std::max(force, 0.0);
    }
    push(x, row, force, acceleration_);
  }
}

double ConstrainedDynamics::drive_force(const Block& x, const VelocityVector& v) const {
  const Row& row = force_.c.rows[x.first];
  const Drive& drive = force_model_.drives[x.source];
  return row.beta * (drive.stiffness + drive.damping) - drive.damping * row_velocity(row, v[x.a], v[x.b]);
}

int ConstrainedDynamics::side_of(const Block& x, const VelocityVector& v) const {
  const double force = drive_force(x, v);
  const double most = force_model_.drives[x.source].max_force;
  return force > most ? 1 : force < -most ? -1 : 0;
}

void ConstrainedDynamics::respond(VelocityVector& v) {
  make_mlcp(rigid_, v, mlcp_);
  for (std::size_t i = 0; i < place_.size(); ++i) {
    if (place_[i] >= 0) mlcp_.rows[place_[i]] = mlcp_.rows[i];
  }
  mlcp_.rows.resize(mlcp_.rows.size() - redundant_rows_);
  solver_.solve(mlcp_);
  add_impulses(rigid_model_, solver_.impulses(), v);
  row_solves_ += std::ssize(mlcp_.rows);
}

}  // namespace substep
