// s2 of joints: lists their blocks, and computes the rows of locks, limits and drives.

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/constraints/formulate.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

using std::numbers::pi;

/// Sets a row's angular parts from ᵣJ̆ᵀ in the bodies' frames, and 1/Γ.
[[gnu::always_inline]] inline void set_angular(const Problem& problem, const Block& x, const Vector3& local_a,
                                               const Vector3& local_b, Row& row) {
  const Vector3 response_a = problem.model->masses[x.a].inverse_inertia.cwiseProduct(local_a);
  const Vector3 response_b = problem.model->masses[x.b].inverse_inertia.cwiseProduct(local_b);
  const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                       local_a.dot(response_a) + local_b.dot(response_b);
  row.effective_mass = gamma > 0 ? 1 / gamma : 0;
  row.angular_a = local_a;
  row.angular_b = local_b;
  row.response_a = response_a;
  row.response_b = response_b;
}

/// Sets a row that is rigid and two-sided. Its impulse stays, since a block may be formulated between
/// iterations.
void set_rigid(double beta, const Vector3& linear, Row& row) {
  row.linear = linear;
  row.beta = beta;
  row.low = -infinity;
  row.high = infinity;
  row.softness = 0;
}

/// Returns the pseudo-inverse of Γ: 0 along eigenvectors in which rounding alone moves the bodies.
Matrix3 inverse_where_movable(const Matrix3& gamma) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(gamma);
  const Vector3& values = solver.eigenvalues();
  const Vector3 inverse = (values.array() > 1e-12 * values[2]).select(values.cwiseInverse(), 0.0);
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
}

/// Sets the inverse of Γ of a block's rows.
void invert_gamma(Constraints& c, const Block& x) {
  Matrix3 gamma = Matrix3::Identity();
  const std::span<Row> rows = c.rows_of(x);
  for (int i = 0; i < x.rows; ++i) {
    const Row& r = rows[i];
    for (int j = 0; j <= i; ++j) {
      const Row& s = rows[j];
      gamma(i, j) = gamma(j, i) = r.linear.dot(s.linear) * (x.inverse_mass_a + x.inverse_mass_b) +
                                  r.angular_a.dot(s.response_a) + r.angular_b.dot(s.response_b);
    }
  }
  Matrix3& inverse = c.effective_masses[x.coupling];
  double determinant = 0;
  bool is_regular = false;
  gamma.computeInverseAndDetWithCheck(inverse, determinant, is_regular, 1e-12 * gamma.diagonal().prod());
  if (is_regular) return;
  for (int i = x.rows; i < 3; ++i) gamma(i, i) = 0;
  inverse = inverse_where_movable(gamma);
}

/// The attachment frames in the world.
struct Frames {
  Vector3 arm_a;  ///< from a's centre of mass to its frame's origin
  Vector3 arm_b;
  Vector3 offset;  ///< from b's origin to a's
  Matrix3 axes_a;  ///< columns
  Matrix3 axes_b;
};

Frames frames_of(const Attachment& attachment, const BlockCoordinates& at) {
  Frames f;
  f.arm_a = at.rotation_a * attachment.frame_a.position;
  f.arm_b = at.rotation_b * attachment.frame_b.position;
  f.offset = (at.a.linear + f.arm_a) - (at.b.linear + f.arm_b);
  f.axes_a = at.rotation_a * attachment.frame_a.orientation.toRotationMatrix();
  f.axes_b = at.rotation_b * attachment.frame_b.orientation.toRotationMatrix();
  return f;
}

/// A coordinate's value, and its rate as a row: the linear part, and ᵣJᵀ of both bodies in the world frame.
struct Measured {
  double value = 0;
  Vector3 linear = Vector3::Zero();
  Vector3 angular_a = Vector3::Zero();
  Vector3 angular_b = Vector3::Zero();
};

/// Returns the offset of a's origin from b's along a unit vector that is fixed in b. The rotation of b adds
/// ω_b × direction · offset, as if b's arm reached to a's origin; this is 0 where the vector follows the
/// offset.
Measured along(const Frames& f, const Vector3& direction) {
  return {direction.dot(f.offset), direction, f.arm_a.cross(direction), direction.cross(f.arm_b + f.offset)};
}

Measured about(double value, const Vector3& axis) {
  return {value, Vector3::Zero(), axis, -axis};
}

/// Returns the rotation from b's frame to a's, in b's axes.
Quaternion relative_rotation(const Frames& f) {
  Quaternion q(Matrix3(f.axes_b.transpose() * f.axes_a));
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

/// Distance from an axis, relative to that along it, below which a point has no direction across the axis.
constexpr double on_axis = 1e-12;

Measured measure(const JointCoordinate& coordinate, const Frames& f) {
  using Kind = JointCoordinate::Kind;
  const Vector3 axis_b = f.axes_b.col(coordinate.axis);
  const Vector3 across_b = f.axes_b.col((coordinate.axis + 1) % 3);  // where a direction is not determined
  switch (coordinate.kind) {
    case Kind::position:
      return along(f, axis_b);
    case Kind::radius: {
      const Vector3 across = f.offset - axis_b * axis_b.dot(f.offset);
      const double radius = across.norm();
      // On the axis `across` is rounding, so take an axis of b.
      return along(f, radius > on_axis * f.offset.norm() ? Vector3(across / radius) : across_b);
    }
    case Kind::distance: {
      const double distance = f.offset.norm();
      return along(f, distance > 0 ? Vector3(f.offset / distance) : across_b);
    }
    case Kind::twist: {
      // θ = 2 atan2(q_k, q_w), and its gradient by q' = ½ ω ∘ q, ω the relative velocity in b's axes.
      const Quaternion q = relative_rotation(f);
      const Vector3 v = q.vec();
      const double k = v[coordinate.axis];
      const Vector3 unit = Vector3::Unit(coordinate.axis);
      const double squared = q.w() * q.w() + k * k;
      if (squared == 0) return about(0, axis_b);
      const Vector3 axis = (q.w() * q.w() * unit + q.w() * v.cross(unit) + k * v) / squared;
      double angle = 2 * angle_of(k, q.w());
      if (angle - coordinate.middle > pi) angle -= 2 * pi;
      if (angle - coordinate.middle < -pi) angle += 2 * pi;
      return about(angle, f.axes_b * axis);
    }
    case Kind::cone:
    case Kind::sway: {
      const Vector3 axis_a = f.axes_a.col(coordinate.axis);
      const Vector3 cross = axis_b.cross(axis_a);
      const double sine = cross.norm();
      const double angle = angle_of(sine, axis_a.dot(axis_b));
      const Vector3 normal = sine > 0 ? Vector3(cross / sine) : across_b;
      if (coordinate.kind == Kind::cone) return about(angle, normal);
      // Half the square of the angle φ curves by φ/sin φ (ω · n × axis_a)(ω · n × axis_b). Square the mean of
      // both factors: it exceeds their product, so that a spring gains no energy.
      return about(0, std::sqrt(sine > 0 ? angle / sine : 1) / 2 * normal.cross(axis_a + axis_b));
    }
    case Kind::offset: {
      const Vector3 axis = Vector3::Unit(coordinate.axis);
      return {f.offset[coordinate.axis], axis, f.arm_a.cross(axis), axis.cross(f.arm_b)};
    }
    case Kind::rotation_vector:
      return about(rotation_vector(relative_rotation(f))[coordinate.axis], axis_b);
    case Kind::turn:
      break;
  }
  const Vector3 turn = rotation_vector(relative_rotation(f));
  const double angle = turn.norm();
  return about(angle, angle > 0 ? Vector3(f.axes_b * (turn / angle)) : across_b);
}

/// Sets the row of ± a coordinate's rate.
void set_row(const Problem& problem, const Block& x, const BlockCoordinates& at, const Measured& m,
             double sign, double beta, Row& row) {
  set_rigid(beta, sign * m.linear, row);
  set_angular(problem, x, at.rotation_a.transpose() * (sign * m.angular_a),
              at.rotation_b.transpose() * (sign * m.angular_b), row);
}

/// Adds softness to a row whose Γ is set.
void soften(double softness, Row& row) {
  row.softness = softness;
  if (row.effective_mass > 0) row.effective_mass = 1 / (1 / row.effective_mass + softness);
}

/// Formulates a lock of the frames' origins, along the world's axes, which rotate with neither body.
void formulate_point(Problem& problem, const Block& x, const BlockCoordinates& at, double hs) {
  const Attachment& attachment = problem.model->locks[x.source].at;
  const Vector3& arm_a = attachment.frame_a.position;
  const Vector3& arm_b = attachment.frame_b.position;
  const Vector3 offset = (at.a.linear + at.rotation_a * arm_a) - (at.b.linear + at.rotation_b * arm_b);
  for (int k = 0; k < x.rows; ++k) {
    const int axis = x.component + k;
    Row& row = problem.c.rows[x.first + k];
    set_rigid(-offset[axis] / hs, Vector3::Unit(axis), row);
    set_angular(problem, x, arm_a.cross(at.rotation_a.row(axis).transpose()),
                at.rotation_b.row(axis).transpose().cross(arm_b), row);
  }
}

void formulate_lock(Problem& problem, const Block& x, const BlockCoordinates& at, double hs) {
  const Lock& lock = problem.model->locks[x.source];
  if (lock.kind == Lock::Kind::point) {
    formulate_point(problem, x, at, hs);
    return;
  }
  const Frames f = frames_of(lock.at, at);
  for (int k = 0; k < x.rows; ++k) {
    const int component = x.component + k;
    const int across = (lock.axis + 1 + component) % 3;
    Measured m;
    switch (lock.kind) {
      case Lock::Kind::point:
        break;
      case Lock::Kind::line:
        m = along(f, f.axes_b.col(across));
        break;
      case Lock::Kind::direction: {
        // C = axis of a · axis across it of b: its rate is (ω_a − ω_b) · (axis_a × across_b).
        const Vector3 axis_a = f.axes_a.col(lock.axis);
        const Vector3 across_b = f.axes_b.col(across);
        m = about(axis_a.dot(across_b), axis_a.cross(across_b));
        // Above 90° this C leads to 180°, so take a turn of 1 rad from axis_b to axis_a.
        const Vector3 axis_b = f.axes_b.col(lock.axis);
        if (axis_a.dot(axis_b) < 0) {
          const Vector3 normal = axis_b.cross(across_b);
          m = about(shortest_rotation(axis_b, axis_a).vec().normalized().dot(normal), normal);
        }
        break;
      }
      case Lock::Kind::orientation: {
        // C = 2 vec(q), the rotation vector to first order; its rate by q' = ½ ω ∘ q.
        const Quaternion q = relative_rotation(f);
        const Vector3 unit = Vector3::Unit(component);
        m = about(2 * q.vec()[component], f.axes_b * (q.w() * unit + q.vec().cross(unit)));
        break;
      }
    }
    set_row(problem, x, at, m, 1, -m.value / hs, problem.c.rows[x.first + k]);
  }
}

/// Scales a block's biases to a part of a step. Each part removes its fraction of a gap, all at one speed; a
/// short part would need a high speed to remove the whole gap.
void take_part_of_gap(Problem& problem, Block& x) {
  x.positional_bias_fraction = problem.substeps.part;
  for (Row& row : problem.c.rows_of(x)) row.beta *= problem.substeps.part;
}

void formulate_limit(Problem& problem, Block& x, const BlockCoordinates& at, double hs) {
  const Limit& limit = problem.model->limits[x.source];
  const Measured m = measure(limit.coordinate, frames_of(limit.at, at));
  const bool two_sided = limit.side == Limit::Side::both;
  const double sign = limit.side == Limit::Side::high ? -1 : 1;
  const double room = sign * (m.value - limit.bound);  // >= 0 within the bound
  Row& row = problem.c.rows[x.first];
  set_row(problem, x, at, m, sign, -room / hs, row);
  if (!two_sided) row.low = 0;
  x.positional_bias_fraction = 1;
  if (room < 0 || two_sided) take_part_of_gap(problem, x);
  x.stabilized = !limit.soft;
  if (limit.soft) {
    // λ = −hs (stiffness (room + hs Jv') + damping Jv'), in the form Jv' + softness λ = β. Within the bound β
    // lets the room close; beyond it the spring acts already.
    const double strength = hs * limit.stiffness + limit.damping;
    if (room <= 0 || two_sided) {
      row.beta = -room * limit.stiffness / strength;
      x.positional_bias_fraction = hs * limit.stiffness / strength;
    }
    soften(1 / (hs * strength), row);
  }
}

void formulate_drive(Problem& problem, Block& x, const BlockCoordinates& at, double hs) {
  const Drive& drive = problem.model->drives[x.source];
  const Measured m = measure(drive.coordinate, frames_of(drive.at, at));
  // The force at the step's end: λ = hs (stiffness (target − x − hs Jv') + damping (target' − Jv')).
  const double strength = hs * drive.stiffness + drive.damping;
  const double pull =
      drive.stiffness * (drive.position_target - m.value) + drive.damping * drive.velocity_target;
  Row& row = problem.c.rows[x.first];
  set_row(problem, x, at, m, 1, pull / strength, row);
  x.positional_bias_fraction = hs * drive.stiffness / strength;
  x.stabilized = false;
  const double mass = drive.per_mass ? row.effective_mass : 1;
  row.high = hs * drive.max_force * mass;
  row.low = -row.high;
  if (mass > 0) soften(1 / (hs * strength * mass), row);
}

/// Sorts the blocks and renumbers their rows, such that successive blocks seldom share a moving body. Blocks
/// that share one keep their order.
void interleave(const Model& model, Constraints& c) {
  // A block's level is one above those of the blocks that it waits for.
  // By body: length of the longest chain of waits that ends in it.
  std::vector<int> depth(model.masses.size(), 0);
  std::vector<std::pair<int, Block>> by_level;
  for (const Block& x : c.blocks) {
    const int level = std::max(depth[x.a], depth[x.b]);
    for (const int body : {x.a, x.b}) {
      if (moves(model.masses[body])) depth[body] = level + 1;
    }
    by_level.emplace_back(level, x);
  }
  std::ranges::stable_sort(by_level, {}, &std::pair<int, Block>::first);
  int row = 0;
  for (std::size_t i = 0; i < by_level.size(); ++i) {
    c.blocks[i] = by_level[i].second;
    c.blocks[i].first = row;
    row += c.blocks[i].rows;
  }
}

}  // namespace

double value_of(const JointCoordinate& coordinate, const Attachment& at, const std::vector<Coordinates>& q) {
  const Matrix3 rotation_a = q[at.a].angular.toRotationMatrix();
  const Matrix3 rotation_b = q[at.b].angular.toRotationMatrix();
  return measure(coordinate, frames_of(at, {q[at.a], q[at.b], rotation_a, rotation_b})).value;
}

void formulate_block(Problem& problem, Block& x, const BlockCoordinates& at, double hs) {
  switch (x.kind) {
    case Block::Kind::lock:
      formulate_lock(problem, x, at, hs);
      take_part_of_gap(problem, x);
      break;
    case Block::Kind::limit:
      formulate_limit(problem, x, at, hs);
      break;
    case Block::Kind::drive:
      formulate_drive(problem, x, at, hs);
      break;
  }
  if (x.rows > 1) invert_gamma(problem.c, x);
}

void build_blocks(Problem& problem, Joints joints) {
  Constraints& c = problem.c;
  const Model& model = *problem.model;
  c.blocks.clear();
  c.effective_masses.clear();
  int rows_in_all = 0;
  const auto add = [&](Block::Kind kind, int rows, int component, const Attachment& at,
                       std::size_t source) -> Block& {
    Block x{};
    x.kind = kind;
    x.rows = static_cast<std::uint8_t>(rows);
    x.component = static_cast<std::uint8_t>(component);
    x.a = at.a;
    x.b = at.b;
    x.source = static_cast<int>(source);
    x.inverse_mass_a = model.masses[at.a].inverse_mass;
    x.inverse_mass_b = model.masses[at.b].inverse_mass;
    rows_in_all += rows;
    if (rows > 1) {
      x.coupling = static_cast<int>(c.effective_masses.size());
      c.effective_masses.emplace_back();
    }
    return c.blocks.emplace_back(x);
  };
  for (std::size_t i = 0; i < model.locks.size(); ++i) {
    const Lock& lock = model.locks[i];
    const int rows = lock.kind == Lock::Kind::point || lock.kind == Lock::Kind::orientation ? 3 : 2;
    if (joints == Joints::rows) {
      for (int k = 0; k < rows; ++k) add(Block::Kind::lock, 1, k, lock.at, i);
    } else {
      add(Block::Kind::lock, rows, 0, lock.at, i).stable = joints == Joints::stable;
    }
  }
  for (std::size_t i = 0; i < model.limits.size(); ++i) {
    const Limit& limit = model.limits[i];
    // A distance that is both bounds is the report's stiff spring, which is stable. The report does not list
    // other two-sided limits; a slot that rotates with its body has a larger error in A5 with more sub-steps.
    using Kind = JointCoordinate::Kind;
    const Kind kind = limit.coordinate.kind;
    const bool is_stiff_spring =
        limit.side == Limit::Side::both && (kind == Kind::distance || kind == Kind::offset);
    add(Block::Kind::limit, 1, 0, limit.at, i).stable = joints == Joints::stable && is_stiff_spring;
  }
  for (std::size_t i = 0; i < model.drives.size(); ++i) add(Block::Kind::drive, 1, 0, model.drives[i].at, i);
  c.rows.resize(rows_in_all);
  interleave(model, c);
  problem.substeps.free_rotations.resize(model.gyroscopic.size());
  build_contacts(problem);
}

void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs) {
  problem.rotations.resize(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) problem.rotations[i] = q[i].angular.toRotationMatrix();
  for (Block& x : problem.c.blocks) {
    formulate_block(problem, x, {q[x.a], q[x.b], problem.rotations[x.a], problem.rotations[x.b]}, hs);
  }
  formulate(problem.c.contacts, *problem.contacts, q, problem.rotations, hs);
}

}  // namespace substep
