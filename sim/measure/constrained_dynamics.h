#pragma once
/// The equations of motion with their constraints differentiated twice (index 1), and the projection onto the
/// constraints, as long as no event changes the set of rows. J̆' v̆ is computed in closed form for locks, by
/// differences for limits. Internal to the reference integrator.

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "sim/algorithms.h"
#include "sim/direct/direct_solver.h"

namespace substep {

/// Returns G, whose columns are the rows' parts of all bodies: Γ = GᵀG.
inline Eigen::MatrixXd columns_of(const Mlcp& mlcp) {
  const auto rows = static_cast<Eigen::Index>(mlcp.rows.size());
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6) * mlcp.bodies, rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Mlcp::Row& row = mlcp.rows[i];
    if (row.a >= 0) g.col(i).segment<6>(6 * row.a) += row.part_a;
    if (row.b >= 0) g.col(i).segment<6>(6 * row.b) += row.part_b;
  }
  return g;
}

/// Factors the rows' directions, which have unit length in the metric of the masses. The rank counts the rows
/// that are linearly independent to `tolerance`.
inline Eigen::FullPivHouseholderQR<Eigen::MatrixXd> factored_directions(const Mlcp& mlcp, double tolerance) {
  Eigen::FullPivHouseholderQR<Eigen::MatrixXd> factored(columns_of(mlcp).colwise().normalized());
  factored.setThreshold(tolerance);
  return factored;
}

/// The motion of a joint's two frames in the world.
struct JointMotion {
  JointMotion(const Attachment& at, const CoordinateVector& q, const std::vector<Matrix3>& rotations,
              const VelocityVector& v)
      : axes_a(rotations[at.a] * at.frame_a.orientation.toRotationMatrix()),
        axes_b(rotations[at.b] * at.frame_b.orientation.toRotationMatrix()),
        spin_a(rotations[at.a] * v[at.a].angular),
        spin_b(rotations[at.b] * v[at.b].angular) {
    const Vector3 arm_a = rotations[at.a] * at.frame_a.position;
    const Vector3 arm_b = rotations[at.b] * at.frame_b.position;
    offset = q[at.a].linear + arm_a - (q[at.b].linear + arm_b);
    offset_rate = v[at.a].linear + spin_a.cross(arm_a) - (v[at.b].linear + spin_b.cross(arm_b));
    centripetal = spin_a.cross(spin_a.cross(arm_a)) - spin_b.cross(spin_b.cross(arm_b));
  }

  Matrix3 axes_a;
  Matrix3 axes_b;
  Vector3 spin_a;
  Vector3 spin_b;
  Vector3 offset;       ///< from b's origin to a's, m
  Vector3 offset_rate;  ///< m/s
  Vector3 centripetal;  ///< second derivative of `offset` without the bodies' accelerations, m/s²
};

/// Returns J̆' v̆ of a lock's rows: the second derivative of their C without acceleration.
inline Vector3 second_derivative(const Lock& lock, const JointMotion& t) {
  if (lock.kind == Lock::Kind::point) return t.centripetal;
  if (lock.kind == Lock::Kind::orientation) {
    // C = 2 vec(q), q' = ½ Ω ∘ q: q'' = ½ Ω' ∘ q − ¼ Ω² q, with Ω in b's axes, which turn.
    const Matrix3 from_world = t.axes_b.transpose();
    Quaternion q(Matrix3(from_world * t.axes_a));
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const Vector3 turn_rate = from_world * t.spin_a.cross(t.spin_b);
    return q.w() * turn_rate + turn_rate.cross(q.vec()) - 0.5 * (t.spin_a - t.spin_b).squaredNorm() * q.vec();
  }
  const Vector3 axis = t.axes_a.col(lock.axis);
  const Vector3 axis_rate = t.spin_a.cross(axis);
  const Vector3 axis_bend = t.spin_a.cross(axis_rate);
  Vector3 result = Vector3::Zero();
  for (int component = 0; component < 2; ++component) {
    const Vector3 across = t.axes_b.col((lock.axis + 1 + component) % 3);
    const Vector3 rate = t.spin_b.cross(across);
    const Vector3 bend = t.spin_b.cross(rate);
    result[component] = lock.kind == Lock::Kind::line
                            // C = offset · across
                            ? t.centripetal.dot(across) + 2 * t.offset_rate.dot(rate) + t.offset.dot(bend)
                            // direction: C = axis of a · across
                            : axis_bend.dot(across) + 2 * axis_rate.dot(rate) + axis.dot(bend);
  }
  return result;
}

/// The dynamics of bodies with rigid two-sided rows, whose λ is solved for, and with springs and drives,
/// which are forces. Velocities are local ones, v̆.
class ConstrainedDynamics {
 public:
  /// `size`: of the scene, m. One-sided limits are rows only while they are held.
  ConstrainedDynamics(const Model& model, double size)
      : size_(size),
        rigid_model_(rigid_part(model)),
        force_model_(force_part(model)),
        two_sided_(rigid_model_.limits.size()),
        drive_sides_(model.drives.size()),
        limit_model_(rigid_model_) {
    limit_model_.locks.clear();
    hold({});
  }
  ConstrainedDynamics(const ConstrainedDynamics&) = delete;
  ConstrainedDynamics& operator=(const ConstrainedDynamics&) = delete;

  /// Makes these one-sided limits two-sided rows, and releases all others.
  void hold(const std::vector<Limit>& bounds) {
    rigid_model_.limits.resize(two_sided_);
    for (const Limit& bound : bounds) {
      rigid_model_.limits.push_back(bound);
      rigid_model_.limits.back().side = Limit::Side::both;
    }
    limit_model_.limits = rigid_model_.limits;
    for (auto [problem, model] : {std::pair(&rigid_, &rigid_model_), std::pair(&force_, &force_model_),
                                  std::pair(&limit_, &limit_model_)}) {
      problem->model = model;
      build_blocks(*problem, Joints::rows);
    }
    keep_all_rows();
  }

  /// Returns λ of the limits that are held, N or N·m.
  std::vector<double> pushes(const CoordinateVector& q, const VelocityVector& v) {
    std::vector<double> all(rigid_model_.limits.size());
    accelerate(q, v);
    for (const Block& x : rigid_.c.blocks) {
      if (x.kind == Block::Kind::limit) all[x.source] = lambda_of(x.first);
    }
    return {all.begin() + static_cast<std::ptrdiff_t>(two_sided_), all.end()};
  }

  /// Return the limit at which each drive's force is (1: the greatest force, −1: the opposite one, 0: none):
  /// drive_sides() as the integrator assumes it, drive_sides_at() as q and v give it.
  const std::vector<int>& drive_sides() const { return drive_sides_; }
  void set_drive_sides(std::vector<int> sides) { drive_sides_ = std::move(sides); }
  std::vector<int> drive_sides_at(const CoordinateVector& q, const VelocityVector& v) {
    std::vector<int> sides(force_model_.drives.size());
    if (sides.empty()) return sides;
    formulate(force_, q, 1);
    for (const Block& x : force_.c.blocks) {
      if (x.kind == Block::Kind::drive) sides[x.source] = side_of(x, v);
    }
    return sides;
  }

  /// Returns the largest |C(q)| of a row.
  double violation(const CoordinateVector& q) {
    formulate(rigid_, q, 1);
    double furthest = 0;
    for (const Row& row : rigid_.c.rows) furthest = std::max(furthest, std::abs(row.beta));
    return furthest;
  }

  /// Leaves out redundant rows until the next call. A row is redundant where its direction depends linearly
  /// on the others to `tolerance`. Redundant rows of a closed loop contradict one another at the inner points
  /// of a step, which drift from C(q) = 0.
  void choose_rows(const CoordinateVector& q, double tolerance) {
    keep_all_rows();
    if (rigid_.c.blocks.empty()) return;
    formulate(rigid_, q, 1);
    make_mlcp(rigid_, VelocityVector(q.size()), mlcp_);
    const auto factored = factored_directions(mlcp_, tolerance);
    const auto& order = factored.colsPermutation().indices();
    kept_rows_.assign(order.data(), order.data() + factored.rank());
    std::ranges::sort(kept_rows_);
  }

  /// Returns the accelerations v̆' at q and v̆.
  VelocityVector accelerate(const CoordinateVector& q, const VelocityVector& v) {
    VelocityVector acceleration(v.size());
    const Model& model = rigid_model_;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (model.masses[i].inverse_mass > 0)
        acceleration[i].linear = model.masses[i].gravity_factor * model.gravity;
    }
    for (const int i : model.gyroscopic) {
      const Vector3& spin = v[i].angular;
      const Vector3 momentum = model.inertia[i].cwiseProduct(spin);
      acceleration[i].angular = model.masses[i].inverse_inertia.cwiseProduct(momentum.cross(spin));
    }
    if (!force_.c.blocks.empty()) add_forces(q, v, acceleration);
    if (rigid_.c.blocks.empty()) return acceleration;
    formulate(rigid_, q, 1);
    set_second_derivatives(q, v);
    respond(acceleration);
    return acceleration;
  }

  /// Projects q onto C(q) = 0 by Newton's method in the metric of the masses, then v̆ onto J̆ v̆ = 0.
  void project(CoordinateVector& q, VelocityVector& v) {
    if (rigid_.c.blocks.empty()) return;
    for (int i = 0; i < 4; ++i) {
      const double furthest = violation(q);
      if (!(furthest > 1e-15 * size_)) break;
      VelocityVector change(v.size());
      respond(change);
      step_coordinates(1, change, q);
      if (furthest < 1e-8 * size_) break;  // what is left is of second order
    }
    for (Row& row : rigid_.c.rows) row.beta = 0;
    respond(v);
  }

  std::int64_t row_solves() const { return row_solves_; }

 private:
  void keep_all_rows() {
    kept_rows_.resize(rigid_.c.rows.size());
    std::iota(kept_rows_.begin(), kept_rows_.end(), 0);
  }

  /// Returns the model without one-sided limits and without forces.
  static Model rigid_part(Model model) {
    model.drives.clear();
    std::erase_if(model.limits,
                  [](const Limit& limit) { return limit.soft || limit.side != Limit::Side::both; });
    return model;
  }

  /// Returns the model's springs and drives alone.
  static Model force_part(Model model) {
    model.locks.clear();
    std::erase_if(model.limits, [](const Limit& limit) { return !limit.soft; });
    return model;
  }

  /// Adds springs and drives as joint_rows.cpp does for hs → 0: stiffness · deflection − damping · rate.
  void add_forces(const CoordinateVector& q, const VelocityVector& v, VelocityVector& acceleration) {
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
        if (both || row.beta >= 0) force = spring_force(x, limit.stiffness, limit.damping, v);
        if (!both) force = std::max(force, 0.0);
      }
      apply(force_.c, x, {force}, acceleration);
    }
  }

  /// Sets β of each row to −J̆' v̆; the rows are formulated at q.
  void set_second_derivatives(const CoordinateVector& q, const VelocityVector& v) {
    std::vector<Vector3> lock_terms;
    for (const Lock& lock : rigid_model_.locks)
      lock_terms.push_back(second_derivative(lock, JointMotion(lock.at, q, rigid_.rotations, v)));
    const std::vector<double> terms_of_limits = limit_terms(q, v);
    for (const Block& x : rigid_.c.blocks) {
      rigid_.c.rows[x.first].beta =
          x.kind == Block::Kind::lock ? -lock_terms[x.source][x.component] : -terms_of_limits[x.source];
    }
  }

  /// Returns the terms of limits by the central difference of order 8 along the motion. The difference's time
  /// is short beside a turn and beside the bodies, so that its error is below rounding.
  std::vector<double> limit_terms(const CoordinateVector& q, const VelocityVector& v) {
    std::vector<double> terms(limit_model_.limits.size());
    if (terms.empty()) return terms;
    constexpr std::array weights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    double rate = 0;
    for (const Velocity& body : v)
      rate = std::max(rate, body.angular.norm() + body.linear.norm() / (0.05 * size_));
    const double shift = rate > 0 ? 0.02 / rate : 1;
    for (int k = 0; k < std::ssize(weights); ++k) {
      for (const int sign : {1, -1}) {
        CoordinateVector shifted = q;
        step_coordinates(sign * (k + 1) * shift, v, shifted);
        formulate(limit_, shifted, 1);
        const double weight = sign * weights.at(k) / shift;
        for (const Block& x : limit_.c.blocks)
          terms[x.source] += weight * row_velocity(limit_.c.rows[x.first], v[x.a], v[x.b]);
      }
    }
    return terms;
  }

  /// Returns the force of a spring with a damper. With hs = 1, β is that force over stiffness + damping.
  double spring_force(const Block& x, double stiffness, double damping, const VelocityVector& v) const {
    const Row& row = force_.c.rows[x.first];
    return row.beta * (stiffness + damping) - damping * row_velocity(row, v[x.a], v[x.b]);
  }

  /// Returns the force of a drive without its limit.
  double drive_force(const Block& x, const VelocityVector& v) const {
    const Drive& drive = force_model_.drives[x.source];
    return spring_force(x, drive.stiffness, drive.damping, v);
  }

  /// Returns 1 at the greatest force, −1 at the opposite one, 0 between.
  int side_of(const Block& x, const VelocityVector& v) const {
    const double force = drive_force(x, v);
    const double most = force_model_.drives[x.source].max_force;
    return force > most ? 1 : force < -most ? -1 : 0;
  }

  static double effective_mass(const Block& x, const Row& row) {
    const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                         row.angular_a.dot(row.response_a) + row.angular_b.dot(row.response_b);
    return gamma > 0 ? 1 / gamma : 0;
  }

  /// Adds M̆⁻¹J̆ᵀλ to v such that J̆ v = β, with the current rows.
  void respond(VelocityVector& v) {
    make_mlcp(rigid_, v, mlcp_);
    if (kept_rows_.size() < mlcp_.rows.size()) {
      for (std::size_t k = 0; k < kept_rows_.size(); ++k) mlcp_.rows[k] = mlcp_.rows[kept_rows_[k]];
      mlcp_.rows.resize(kept_rows_.size());
    }
    MlcpReport report;
    if (joints_.solve(mlcp_, lambda_, report) && report.status == MlcpReport::Status::solved) {
      add_impulses(rigid_model_, joints_.impulses(), v);
    } else {
      add_impulses(rigid_model_, solved_densely(), v);
    }
    row_solves_ += std::ssize(mlcp_.rows);
  }

  /// Solves Γλ = right where λ may not be unique: Γ = GᵀG, with G = QRPᵀ. Returns the impulses Gλ by body.
  std::vector<Vector6> solved_densely() {
    const Eigen::FullPivHouseholderQR<Eigen::MatrixXd> factored(columns_of(mlcp_));
    const auto r = factored.matrixQR().topLeftCorner(factored.rank(), factored.rank());
    const auto order = factored.colsPermutation().indices().head(factored.rank());
    Eigen::VectorXd y(factored.rank());
    for (Eigen::Index k = 0; k < y.size(); ++k) y[k] = mlcp_.rows[order[k]].right;
    r.triangularView<Eigen::Upper>().transpose().solveInPlace(y);
    Eigen::VectorXd impulses = Eigen::VectorXd::Zero(factored.rows());
    impulses.head(y.size()) = y;
    impulses = factored.matrixQ() * impulses;
    r.triangularView<Eigen::Upper>().solveInPlace(y);
    lambda_.assign(mlcp_.rows.size(), 0);
    for (Eigen::Index k = 0; k < y.size(); ++k) lambda_[order[k]] = y[k];
    std::vector<Vector6> by_body(mlcp_.bodies);
    for (int body = 0; body < mlcp_.bodies; ++body) by_body[body] = impulses.segment<6>(6 * body);
    return by_body;
  }

  /// Returns λ of a row of rigid_.
  double lambda_of(int row) const {
    const auto found = std::ranges::lower_bound(kept_rows_, row);
    const bool is_kept = found != kept_rows_.end() && *found == row;
    return is_kept ? lambda_[found - kept_rows_.begin()] : 0;
  }

  double size_;
  Model rigid_model_;
  Model force_model_;
  std::size_t two_sided_;  // number of two-sided limits, which come first in rigid_model_.limits
  std::vector<int> drive_sides_;
  Problem rigid_;
  Problem force_;
  Model limit_model_;  // the rigid limits by themselves
  Problem limit_;
  Mlcp mlcp_;
  JointSolver joints_;
  std::vector<double> lambda_;
  std::vector<int> kept_rows_;  // of rigid_, ascending: those that are not redundant
  std::int64_t row_solves_ = 0;
};

}  // namespace substep
