#include "sim/measure/reference_integrator.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "sim/algorithms.h"
#include "sim/constraints/formulate.h"
#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

constexpr int body_numbers = 13;     // position, quaternion, velocity, local angular velocity
constexpr double touching = 1e-9;    // m or rad, and their rates: a bound that is met at the start
constexpr double tolerance = 1e-12;  // by which a bound is overstepped or pulls when it switches
constexpr double most_gap = 1e-4;    // of the scene's size: more is no rounding of the file's numbers
constexpr int most_switches = 20;    // in one step

/// Γλ = right, and the impulses by body: by the envelope method, else densely, where λ may not be unique.
class RowSolver {
 public:
  void solve(const Mlcp& problem) {
    MlcpReport report;
    if (envelope_.solve(problem, lambda_, report)) {
      impulses_ = envelope_.impulses();
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
  const std::vector<Vector6>& impulses() const { return impulses_; }
  const std::vector<double>& lambda() const { return lambda_; }

 private:
  EnvelopeSolver envelope_;
  std::vector<double> lambda_;
  std::vector<Vector6> impulses_;
};

/// How the two frames of a joint move, in the world.
struct Turning {
  Turning(const Attachment& joint, const CoordinateVector& q, const std::vector<Matrix3>& rotations,
          const VelocityVector& v)
      : at(joint),
        rotation_a(rotations[at.a]),
        rotation_b(rotations[at.b]),
        spin_a(rotation_a * v[at.a].angular),
        spin_b(rotation_b * v[at.b].angular) {
    const Vector3 arm_a = rotation_a * at.frame_a.position;
    const Vector3 arm_b = rotation_b * at.frame_b.position;
    offset = q[at.a].linear + arm_a - (q[at.b].linear + arm_b);
    speed = v[at.a].linear + spin_a.cross(arm_a) - (v[at.b].linear + spin_b.cross(arm_b));
    centripetal = spin_a.cross(spin_a.cross(arm_a)) - spin_b.cross(spin_b.cross(arm_b));
  }
  Matrix3 axes_a() const { return rotation_a * at.frame_a.orientation.toRotationMatrix(); }
  Matrix3 axes_b() const { return rotation_b * at.frame_b.orientation.toRotationMatrix(); }

  const Attachment& at;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
  Vector3 spin_a;
  Vector3 spin_b;
  Vector3 offset;  ///< from b's origin to a's
  Vector3 speed;   ///< of it
  Vector3 centripetal;
};

/// J̆' v̆ of a lock's rows: what is left of the second derivative of its C where nothing accelerates.
Vector3 turning_of(const Lock& lock, const Turning& t) {
  if (lock.kind == Lock::Kind::point) return t.centripetal;
  if (lock.kind == Lock::Kind::orientation) {
    // C = 2 vec(q), q' = ½ Ω ∘ q: q'' = ½ Ω' ∘ q − ¼ Ω² q, with Ω in b's axes, which turn.
    const Matrix3 from_world = t.axes_b().transpose();
    Quaternion q(Matrix3(from_world * t.axes_a()));
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const Vector3 turn_rate = from_world * t.spin_a.cross(t.spin_b);
    return q.w() * turn_rate + turn_rate.cross(q.vec()) - 0.5 * (t.spin_a - t.spin_b).squaredNorm() * q.vec();
  }
  const Matrix3 axes_b = t.axes_b();
  const Vector3 axis = t.axes_a().col(lock.axis);
  const Vector3 axis_rate = t.spin_a.cross(axis);
  const Vector3 axis_bend = t.spin_a.cross(axis_rate);
  Vector3 result = Vector3::Zero();
  for (int component = 0; component < 2; ++component) {
    const Vector3 across = axes_b.col((lock.axis + 1 + component) % 3);
    const Vector3 rate = t.spin_b.cross(across);
    const Vector3 bend = t.spin_b.cross(rate);
    result[component] = lock.kind == Lock::Kind::line
                            // C = offset · across
                            ? t.centripetal.dot(across) + 2 * t.speed.dot(rate) + t.offset.dot(bend)
                            // direction: C = axis of a · across
                            : axis_bend.dot(across) + 2 * axis_rate.dot(rate) + axis.dot(bend);
  }
  return result;
}

class SmoothStepper : public Stepper {
 public:
  SmoothStepper(const Scene& scene, double step, int order)
      : step_(step), order_(order), size_(size_of(scene)), state_(initial_state(scene)) {
    const Model model = build_model(scene);
    if (model.contacts) throw Error("it has contacts: its motion is not smooth");
    split(model);
    q_ = state_.q;
    v_ = state_.v;
    for (std::size_t i = 0; i < q_.size(); ++i) v_[i].angular = q_[i].angular.conjugate() * v_[i].angular;
    set_drive_sides();
    hold_bounds_met_at_the_start();
    formulate(rigid_, q_, 1);
    for (const Row& row : rigid_.c.rows) {
      if (std::abs(row.beta) > most_gap * size_) throw Error("its joints are open at the start");
    }
    project();
    store();
  }

  bool step() override {
    start_q_ = q_;
    start_v_ = v_;
    double left = step_;
    for (int switches = 0; switches < most_switches; ++switches) {
      const double taken = advance_to_a_switch(left);
      if (!(taken > 0)) break;
      left -= taken;
      if (left > 0) continue;
      store();
      return true;
    }
    q_ = start_q_;
    v_ = start_v_;
    return false;
  }

  const State& state() const override { return state_; }
  std::int64_t row_solves() const override { return row_solves_; }

 private:
  using Numbers = Eigen::VectorXd;

  /// Rigid two-sided rows, of which λ is asked; springs and drives, which are forces; and rigid bounds, which
  /// are held or open.
  void split(const Model& model) {
    rigid_model_ = model;
    rigid_model_.limits.clear();
    rigid_model_.drives.clear();
    open_model_ = rigid_model_;
    open_model_.locks.clear();
    limit_model_ = open_model_;
    force_model_ = open_model_;
    force_model_.drives = model.drives;
    drive_sides_.assign(model.drives.size(), 0);
    for (const Limit& limit : model.limits) {
      if (limit.soft) {
        force_model_.limits.push_back(limit);
      } else if (limit.side == Limit::Side::both) {
        rigid_model_.limits.push_back(limit);
      } else {
        bounds_.push_back({limit, false});
      }
    }
    two_sided_ = rigid_model_.limits.size();
    set_up();
  }

  /// Rows for the bounds as they are held or open now.
  void set_up() {
    rigid_model_.limits.resize(two_sided_);
    open_model_.limits.clear();
    for (const Bound& bound : bounds_) {
      if (bound.held) {
        rigid_model_.limits.push_back(bound.limit);
        rigid_model_.limits.back().side = Limit::Side::both;
      } else {
        open_model_.limits.push_back(bound.limit);
      }
    }
    limit_model_.limits = rigid_model_.limits;
    for (auto [problem, model] : {std::pair(&rigid_, &rigid_model_), std::pair(&force_, &force_model_),
                                  std::pair(&open_, &open_model_), std::pair(&limit_, &limit_model_)}) {
      problem->model = model;
      problem->contacts = &no_contacts_;
      problem->frame = Frame::body;
      build_blocks(*problem, Joints::rows);
    }
    turning_.resize(rigid_.c.rows.size());
  }

  /// What decides how a bound goes on: the room of an open one (m, rad), the push of one that is held (N,
  /// N·m).
  void judge_bounds() {
    formulate(open_, q_, 1);
    std::vector<double> rooms(open_model_.limits.size());
    for (const Block& x : open_.c.blocks) rooms[x.source] = -open_.c.rows[x.first].beta;
    std::vector<double> pushes(rigid_model_.limits.size());
    accelerate(q_, v_);
    for (const Block& x : rigid_.c.blocks) {
      if (x.kind == Block::Kind::limit) pushes[x.source] = solver_.lambda()[x.first];
    }
    std::size_t held = two_sided_;
    std::size_t open = 0;
    for (Bound& bound : bounds_) {
      const double sign = bound.limit.side == Limit::Side::high ? -1 : 1;
      bound.margin = tolerance + (bound.held ? sign * pushes[held++] : rooms[open++]);
    }
  }

  /// A bound that the start stands at and that pushes, as a taut rope does.
  void hold_bounds_met_at_the_start() {
    if (bounds_.empty()) return;
    formulate(open_, q_, 1);
    for (const Block& x : open_.c.blocks) {
      const Row& row = open_.c.rows[x.first];
      bounds_[x.source].held =
          std::abs(row.beta) < touching && std::abs(row_velocity(row, v_[x.a], v_[x.b])) < touching;
    }
    set_up();
    // Those that pull are open; one goes at a time, as each changes what the others do.
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      judge_bounds();
      const auto least = std::ranges::min_element(bounds_, {}, [](const Bound& bound) {
        return bound.held ? bound.margin : std::numeric_limits<double>::infinity();
      });
      if (!least->held || least->margin >= 0) break;
      least->held = false;
      set_up();
    }
  }

  /// Whether all goes on as it went: drives at or within their greatest force, bounds held or open.
  bool goes_on() {
    if (!force_model_.drives.empty()) {
      formulate(force_, q_, 1);
      for (const Block& x : force_.c.blocks) {
        if (x.kind == Block::Kind::drive && side_of(x) != drive_sides_[x.source]) return false;
      }
    }
    if (bounds_.empty()) return true;
    judge_bounds();
    return std::ranges::all_of(bounds_, [](const Bound& bound) { return bound.margin >= 0; });
  }

  void set_drive_sides() {
    if (force_model_.drives.empty()) return;
    formulate(force_, q_, 1);
    for (const Block& x : force_.c.blocks) {
      if (x.kind == Block::Kind::drive) drive_sides_[x.source] = side_of(x);
    }
  }

  void switch_over() {
    set_drive_sides();
    if (bounds_.empty()) return;
    judge_bounds();
    for (Bound& bound : bounds_) {
      if (bound.margin < 0) bound.held = !bound.held;
    }
    set_up();
    project();  // an impact: what closes a bound is lost
  }

  /// Steps by `length`, or to just after the first switch. Returns the time taken; 0 where the state is no
  /// longer finite.
  double advance_to_a_switch(double length) {
    const CoordinateVector q = q_;
    const VelocityVector v = v_;
    const auto try_length = [&](double trial) {
      q_ = q;
      v_ = v;
      advance(trial);
    };
    try_length(length);
    store();
    if (!is_finite(state_)) return 0;
    if (goes_on()) return length;
    double before = 0;
    double after = length;
    for (int i = 0; i < 60 && after - before > 1e-15 * step_; ++i) {
      const double middle = (before + after) / 2;
      try_length(middle);
      (goes_on() ? before : after) = middle;
    }
    try_length(after);
    switch_over();
    return after;
  }

  void advance(double length) {
    if (order_ == 4) {
      runge_kutta(length);
    } else {
      extrapolate(length);
    }
    project();
  }

  /// v̆' at q and v̆, in `acceleration_`.
  void accelerate(const CoordinateVector& q, const VelocityVector& v) {
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
    if (rigid_.c.blocks.empty()) return;
    formulate(rigid_, q, 1);
    set_turning(q, v);
    for (const Block& x : rigid_.c.blocks) rigid_.c.rows[x.first].beta = -turning_[x.first];
    respond(acceleration_);
  }

  /// What a drive would do without its greatest force: formulated with hs = 1, β is the pull over stiffness +
  /// damping.
  double drive_force(const Block& x, const VelocityVector& v) const {
    const Row& row = force_.c.rows[x.first];
    const Drive& drive = force_model_.drives[x.source];
    return row.beta * (drive.stiffness + drive.damping) - drive.damping * row_velocity(row, v[x.a], v[x.b]);
  }

  /// 1: at its greatest force, −1: at the opposite, 0: within.
  int side_of(const Block& x) const {
    const double force = drive_force(x, v_);
    const double most = force_model_.drives[x.source].max_force;
    return force > most ? 1 : force < -most ? -1 : 0;
  }

  /// Springs and drives as in joint_rows.cpp, with hs → 0: force = stiffness · way − damping · rate.
  void add_forces(const CoordinateVector& q, const VelocityVector& v) {
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
          force = row.beta * (limit.stiffness + limit.damping) -
                  limit.damping * row_velocity(row, v[x.a], v[x.b]);
        }
        if (!both) force = std::max(force, 0.0);
      }
      push(x, row, force, acceleration_);
    }
  }

  static double effective_mass(const Block& x, const Row& row) {
    const double gamma = row.linear.squaredNorm() * (x.inverse_mass_a + x.inverse_mass_b) +
                         row.angular_a.dot(row.response_a) + row.angular_b.dot(row.response_b);
    return gamma > 0 ? 1 / gamma : 0;
  }

  static void push(const Block& x, const Row& row, double force, VelocityVector& v) {
    Velocity& a = v[x.a];
    Velocity& b = v[x.b];
    a.linear += row.linear * (x.inverse_mass_a * force);
    a.angular += row.response_a * force;
    b.linear -= row.linear * (x.inverse_mass_b * force);
    b.angular += row.response_b * force;
  }

  /// J̆' v̆ of each row, in `turning_`; the rows are formulated at q.
  void set_turning(const CoordinateVector& q, const VelocityVector& v) {
    lock_turning_.resize(rigid_model_.locks.size());
    for (std::size_t i = 0; i < lock_turning_.size(); ++i)
      lock_turning_[i] =
          turning_of(rigid_model_.locks[i], Turning(rigid_model_.locks[i].at, q, rigid_.rotations, v));
    for (const Block& x : rigid_.c.blocks) {
      if (x.kind == Block::Kind::lock) turning_[x.first] = lock_turning_[x.source][x.component];
    }
    if (limit_model_.limits.empty()) return;
    // Limits by the central difference of order 8 along the motion, short beside a turn and beside the
    // bodies: its error is below rounding.
    constexpr std::array weights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    double rate = 0;
    for (const Velocity& body : v)
      rate = std::max(rate, body.angular.norm() + body.linear.norm() / (0.05 * size_));
    limit_turning_.assign(limit_model_.limits.size(), 0);
    const double shift = rate > 0 ? 0.02 / rate : 1;
    for (int k = 0; k < std::ssize(weights); ++k) {
      for (const int sign : {1, -1}) {
        shifted_ = q;
        step_coordinates(sign * (k + 1) * shift, v, shifted_);
        formulate(limit_, shifted_, 1);
        const double weight = sign * weights.at(k) / shift;
        for (const Block& x : limit_.c.blocks)
          limit_turning_[x.source] += weight * row_velocity(limit_.c.rows[x.first], v[x.a], v[x.b]);
      }
    }
    for (const Block& x : rigid_.c.blocks) {
      if (x.kind == Block::Kind::limit) turning_[x.first] = limit_turning_[x.source];
    }
  }

  /// v ← v + M̆⁻¹J̆ᵀλ such that J̆ v = β, with the rows as they are.
  void respond(VelocityVector& v) {
    make_mlcp(rigid_, v, mlcp_);
    solver_.solve(mlcp_);
    add_impulses(rigid_model_, solver_.impulses(), v);
    row_solves_ += std::ssize(mlcp_.rows);
  }

  /// Onto C(q) = 0 by Newton's method, the nearest in the metric of the masses; then onto J̆ v̆ = 0.
  void project() {
    if (rigid_.c.blocks.empty()) return;
    for (int i = 0; i < 4; ++i) {
      formulate(rigid_, q_, 1);
      double furthest = 0;
      for (const Row& row : rigid_.c.rows) furthest = std::max(furthest, std::abs(row.beta));
      if (!(furthest > 1e-15 * size_)) break;
      change_.resize(v_.size());
      set_zero(change_);
      respond(change_);
      step_coordinates(1, change_, q_);
      if (furthest < 1e-8 * size_) break;  // what is left is its square
    }
    for (Row& row : rigid_.c.rows) row.beta = 0;
    respond(v_);
  }

  /// The state as numbers, and back; quaternions are of unit length only at the ends of steps.
  void flatten(const CoordinateVector& q, const VelocityVector& v, Numbers& y) const {
    y.resize(static_cast<Eigen::Index>(body_numbers * q.size()));
    for (std::size_t i = 0; i < q.size(); ++i) {
      y.segment<body_numbers>(body_numbers * i) << q[i].linear, q[i].angular.coeffs(), v[i].linear,
          v[i].angular;
    }
  }
  void unflatten(const Numbers& y, CoordinateVector& q, VelocityVector& v) const {
    q.resize(state_.q.size());
    v.resize(q.size());
    for (std::size_t i = 0; i < q.size(); ++i) {
      const auto body = y.segment<body_numbers>(body_numbers * i);
      q[i].linear = body.segment<3>(0);
      q[i].angular.coeffs() = body.segment<4>(3).normalized();
      v[i].linear = body.segment<3>(7);
      v[i].angular = body.segment<3>(10);
    }
  }

  /// y' at y.
  void rate(const Numbers& y, Numbers& result) {
    unflatten(y, trial_q_, trial_v_);
    accelerate(trial_q_, trial_v_);
    result.resize(y.size());
    for (std::size_t i = 0; i < trial_q_.size(); ++i) {
      const Vector3& spin = trial_v_[i].angular;
      // q' = ½ q ∘ ω̆, of the quaternion as it is.
      const Vector3 vector = y.segment<3>(body_numbers * i + 3);
      const double w = y[body_numbers * i + 6];
      result.segment<body_numbers>(body_numbers * i) << trial_v_[i].linear,
          0.5 * (w * spin + vector.cross(spin)), -0.5 * vector.dot(spin), acceleration_[i].linear,
          acceleration_[i].angular;
    }
  }

  void runge_kutta(double length) {
    flatten(q_, v_, start_);
    rate(start_, rate_);
    newer_ = rate_;
    point_ = start_ + length / 2 * rate_;
    rate(point_, rate_);
    newer_ += 2 * rate_;
    point_ = start_ + length / 2 * rate_;
    rate(point_, rate_);
    newer_ += 2 * rate_;
    point_ = start_ + length * rate_;
    rate(point_, rate_);
    newer_ += rate_;
    point_ = start_ + length / 6 * newer_;
    unflatten(point_, q_, v_);
  }

  /// One step by Aitken and Neville's scheme on the midpoint rule with 2, 4, 6 … parts, whose error has even
  /// powers of the part alone. Changes are extrapolated and not values: less rounding.
  void extrapolate(double length) {
    flatten(q_, v_, start_);
    rate(start_, start_rate_);
    const int columns = order_ / 2;
    table_.resize(columns);
    for (int j = 0; j < columns; ++j) {
      const int parts = 2 * (j + 1);
      const double part = length / parts;
      older_.setZero(start_.size());
      newer_ = part * start_rate_;
      for (int i = 1; i < parts; ++i) {
        point_ = start_ + newer_;
        rate(point_, rate_);
        older_ += 2 * part * rate_;
        older_.swap(newer_);
      }
      // Row j of the table, from the left: table_[k] holds row j − 1's entry k until it is replaced.
      previous_ = newer_;
      for (int k = 0; k < j; ++k) {
        const double ratio = static_cast<double>(j + 1) / (j - k);
        extrapolated_ = previous_ + (previous_ - table_[k]) / (ratio * ratio - 1);
        table_[k].swap(previous_);
        previous_.swap(extrapolated_);
      }
      table_[j] = previous_;
    }
    unflatten(start_ + table_.back(), q_, v_);
  }

  void store() {
    state_.q = q_;
    state_.v = v_;
    for (std::size_t i = 0; i < v_.size(); ++i) state_.v[i].angular = q_[i].angular * v_[i].angular;
  }

  /// A rigid one-sided limit. Held, it is a two-sided row as long as it pushes.
  struct Bound {
    Limit limit;
    bool held;
    double margin = 0;
  };

  double step_;
  int order_;
  double size_;
  State state_;
  CoordinateVector q_;
  VelocityVector v_;  // local angular velocities
  CoordinateVector start_q_;
  VelocityVector start_v_;
  std::vector<Contact> no_contacts_;
  Model rigid_model_;
  Model force_model_;
  Model open_model_;
  Model limit_model_;  // the rigid limits by themselves
  Problem rigid_;
  Problem force_;
  Problem open_;
  Problem limit_;
  std::vector<Bound> bounds_;
  std::size_t two_sided_ = 0;     // of rigid_model_.limits, the first
  std::vector<int> drive_sides_;  // by drive: which of its greatest forces it is at
  std::vector<Vector3> lock_turning_;
  std::vector<double> limit_turning_;
  std::vector<double> turning_;  // by row
  Mlcp mlcp_;
  RowSolver solver_;
  std::int64_t row_solves_ = 0;
  CoordinateVector trial_q_;
  CoordinateVector shifted_;
  VelocityVector trial_v_;
  VelocityVector change_;
  VelocityVector acceleration_;
  Numbers start_;
  Numbers start_rate_;
  Numbers point_;
  Numbers rate_;
  Numbers older_;
  Numbers newer_;
  Numbers previous_;
  Numbers extrapolated_;
  std::vector<Numbers> table_;
};

}  // namespace

std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order) {
  return std::make_unique<SmoothStepper>(scene, step, order);
}

}  // namespace substep
