/// The reference DAE integrator, for scenes whose forces are smooth: joints, springs and drives, no contacts.
///
/// The equations of motion in maximal coordinates, with the constraints at acceleration level (differentiated
/// twice: index 1),
///     M̆ v̆' = f + J̆ᵀλ,   J̆ v̆' = −J̆' v̆,
/// are stepped by Runge–Kutta or by the extrapolated midpoint rule (Gragg, Bulirsch, Stoer; Hairer, Nørsett,
/// Wanner, Solving Ordinary Differential Equations I, II.9). After each step coordinates and velocities are
/// projected back onto C(q) = 0 and J̆ v̆ = 0 (Hairer, Wanner, Solving Ordinary Differential Equations II,
/// VII.2). Rows are those of formulate.h. The errors of the report's algorithms are measured against it.
///
/// constrained_dynamics.h has the equations and the projection.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "sim/algorithms.h"
#include "sim/error.h"
#include "sim/measure/constrained_dynamics.h"
#include "sim/measure/motion.h"
#include "sim/measure/stepper.h"

namespace substep {
namespace {

constexpr int body_numbers = 13;   // position, quaternion, velocity, local angular velocity
constexpr double most_gap = 1e-4;  // of the scene's size: more is no rounding of the file's numbers
/// Tolerance of redundant rows; see ConstrainedDynamics::choose_rows. It exceeds the rounding of a file's
/// single-precision numbers. A mechanism that is closer to a singular position at the start of a step loses a
/// row for the step.
constexpr double rank_tolerance = 1e-6;
constexpr int most_events = 20;     // in one step
constexpr double touching = 1e-9;   // m or rad, and their rates: a bound that is met at the start
constexpr double overstep = 1e-12;  // by which a bound is overstepped or pulls when it switches

/// Finds events: a rigid one-sided limit closes or opens, or a drive reaches or leaves its greatest force.
/// Between events the motion is smooth.
class EventDetection {
 public:
  /// Sets in `dynamics` which limits are closed, and which drives are at their greatest force. At first all
  /// limits are open.
  EventDetection(const Model& model, ConstrainedDynamics& dynamics)
      : dynamics_(dynamics), open_model_(model) {
    open_model_.locks.clear();
    open_model_.drives.clear();
    for (const Limit& limit : model.limits) {
      if (!limit.soft && limit.side != Limit::Side::both) bounds_.push_back({limit, false});
    }
    set_up();
  }

  /// Sets the drives for the start, and closes bounds that the start is at and that push, as a taut rope
  /// does.
  void start(const CoordinateVector& q, const VelocityVector& v) {
    dynamics_.set_drive_sides(dynamics_.drive_sides_at(q, v));
    if (bounds_.empty()) return;
    formulate(open_, q, 1);
    for (const Block& x : open_.c.blocks) {
      const Row& row = open_.c.rows[x.first];
      bounds_[x.source].held =
          std::abs(row.beta) < touching && std::abs(row_velocity(row, v[x.a], v[x.b])) < touching;
    }
    set_up();
    // Open the bounds that pull, one at a time: each changes the forces of the others.
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      update_margins(q, v);
      const auto least = std::ranges::min_element(
          bounds_, {}, [](const Bound& bound) { return bound.held ? bound.margin : infinity; });
      if (!least->held || least->margin >= 0) break;
      least->held = false;
      set_up();
    }
  }

  /// Returns true where a drive reaches or leaves its greatest force, or a bound closes or opens.
  bool detect_events(const CoordinateVector& q, const VelocityVector& v) {
    if (dynamics_.drive_sides_at(q, v) != dynamics_.drive_sides()) return true;
    if (bounds_.empty()) return false;
    update_margins(q, v);
    return !std::ranges::all_of(bounds_, [](const Bound& bound) { return bound.margin >= 0; });
  }

  /// Closes and opens bounds by the events at q and v̆, then projects both.
  void apply_events(CoordinateVector& q, VelocityVector& v) {
    dynamics_.set_drive_sides(dynamics_.drive_sides_at(q, v));
    if (bounds_.empty()) return;
    update_margins(q, v);
    for (Bound& bound : bounds_) {
      if (bound.margin < 0) bound.held = !bound.held;
    }
    set_up();
    dynamics_.project(q, v);  // an impact: the velocity that closes a bound is lost
  }

 private:
  /// A rigid one-sided limit, which is a two-sided row while it is closed and pushes.
  struct Bound {
    Limit limit;
    bool held;
    double margin = 0;
  };

  /// Makes rows for the closed bounds.
  void set_up() {
    std::vector<Limit> held;
    open_model_.limits.clear();
    for (const Bound& bound : bounds_) (bound.held ? held : open_model_.limits).push_back(bound.limit);
    dynamics_.hold(held);
    open_.model = &open_model_;
    build_blocks(open_, Joints::rows);
  }

  /// Updates the margin of each bound: the clearance of an open one (m, rad), the force of a closed one (N,
  /// N·m).
  void update_margins(const CoordinateVector& q, const VelocityVector& v) {
    formulate(open_, q, 1);
    std::vector<double> clearances(open_model_.limits.size());
    for (const Block& x : open_.c.blocks) clearances[x.source] = -open_.c.rows[x.first].beta;
    const std::vector<double> pushes = dynamics_.pushes(q, v);
    std::size_t held = 0;
    std::size_t open = 0;
    for (Bound& bound : bounds_) {
      const double sign = bound.limit.side == Limit::Side::high ? -1 : 1;
      bound.margin = overstep + (bound.held ? sign * pushes[held++] : clearances[open++]);
    }
  }

  ConstrainedDynamics& dynamics_;
  std::vector<Bound> bounds_;
  Model open_model_;
  Problem open_;
};

class ReferenceIntegrator : public Stepper {
 public:
  ReferenceIntegrator(const Scene& scene, const Model& model, double step, int order)
      : step_(step),
        order_(order),
        state_(initial_state(scene)),
        q_(state_.q),
        v_(state_.v),
        dynamics_(model, size_of(scene)),
        events_(model, dynamics_) {
    for (std::size_t i = 0; i < q_.size(); ++i) v_[i].angular = q_[i].angular.conjugate() * v_[i].angular;
    events_.start(q_, v_);
    if (dynamics_.violation(q_) > most_gap * size_of(scene)) throw Error("its joints are open at the start");
    for (const double tolerance : {most_gap, rank_tolerance}) {
      dynamics_.choose_rows(q_, tolerance);
      dynamics_.project(q_, v_);
    }
    store();
  }

  bool step() override {
    const CoordinateVector start_q = q_;
    const VelocityVector start_v = v_;
    double left = step_;
    for (int events = 0; events < most_events; ++events) {
      const double taken = advance_to_event(left);
      if (!(taken > 0)) break;
      left -= taken;
      if (left > 0) continue;
      store();
      return true;
    }
    q_ = start_q;
    v_ = start_v;
    store();
    return false;
  }

  const State& state() const override { return state_; }
  std::int64_t row_solves() const override { return dynamics_.row_solves(); }

 private:
  using StateVector = Eigen::VectorXd;

  /// Steps by `length`, or to just after the first event. Returns the time taken; 0 where the state is no
  /// longer finite.
  double advance_to_event(double length) {
    const CoordinateVector q = q_;
    const VelocityVector v = v_;
    dynamics_.choose_rows(q, rank_tolerance);
    const auto try_length = [&](double trial) {
      q_ = q;
      v_ = v;
      advance(trial);
    };
    try_length(length);
    store();
    if (!is_finite(state_)) return 0;
    if (!events_.detect_events(q_, v_)) return length;
    double before = 0;
    double after = length;
    for (int i = 0; i < 60 && after - before > 1e-15 * step_; ++i) {
      const double middle = (before + after) / 2;
      try_length(middle);
      (events_.detect_events(q_, v_) ? after : before) = middle;
    }
    try_length(after);
    events_.apply_events(q_, v_);
    return after;
  }

  void advance(double length) {
    if (order_ == 4) {
      runge_kutta(length);
    } else {
      extrapolate(length);
    }
    dynamics_.project(q_, v_);
  }

  /// Returns the state as numbers.
  StateVector flatten() const {
    StateVector y(static_cast<Eigen::Index>(body_numbers * q_.size()));
    for (std::size_t i = 0; i < q_.size(); ++i) {
      y.segment<body_numbers>(body_numbers * i) << q_[i].linear, q_[i].angular.coeffs(), v_[i].linear,
          v_[i].angular;
    }
    return y;
  }
  /// Sets q and v from such numbers. Inside a step their quaternions are not of unit length.
  static void unflatten(const StateVector& y, CoordinateVector& q, VelocityVector& v) {
    for (std::size_t i = 0; i < q.size(); ++i) {
      const auto body = y.segment<body_numbers>(body_numbers * i);
      q[i].linear = body.segment<3>(0);
      q[i].angular.coeffs() = body.segment<4>(3).normalized();
      v[i].linear = body.segment<3>(7);
      v[i].angular = body.segment<3>(10);
    }
  }

  /// Returns y' at y.
  StateVector rate(const StateVector& y) {
    CoordinateVector q(q_.size());
    VelocityVector v(v_.size());
    unflatten(y, q, v);
    const VelocityVector acceleration = dynamics_.accelerate(q, v);
    StateVector result(y.size());
    for (std::size_t i = 0; i < q.size(); ++i) {
      const Vector3& spin = v[i].angular;
      // q' = ½ q ∘ ω̆, of the quaternion as it is.
      const Vector3 vector = y.segment<3>(body_numbers * i + 3);
      const double w = y[body_numbers * i + 6];
      result.segment<body_numbers>(body_numbers * i) << v[i].linear, 0.5 * (w * spin + vector.cross(spin)),
          -0.5 * vector.dot(spin), acceleration[i].linear, acceleration[i].angular;
    }
    return result;
  }

  /// Makes one step by the classical Runge–Kutta method.
  void runge_kutta(double length) {
    const StateVector start = flatten();
    StateVector point = start;
    StateVector sum = StateVector::Zero(start.size());
    for (const auto& [weight, next] :
         {std::pair{1.0, length / 2}, {2.0, length / 2}, {2.0, length}, {1.0, 0.0}}) {
      const StateVector slope = rate(point);
      sum += weight * slope;
      point = start + next * slope;
    }
    unflatten(start + length / 6 * sum, q_, v_);
  }

  /// Makes one step by Aitken and Neville's scheme on the midpoint rule with 2, 4, 6 … parts, whose error has
  /// even powers of the part alone. Changes are extrapolated and not values: less rounding.
  void extrapolate(double length) {
    const StateVector start = flatten();
    const StateVector start_rate = rate(start);
    std::vector<StateVector> table(order_ / 2);
    for (int j = 0; j < order_ / 2; ++j) {
      const int parts = 2 * (j + 1);
      const double part = length / parts;
      StateVector older = StateVector::Zero(start.size());
      StateVector newer = part * start_rate;
      for (int i = 1; i < parts; ++i) {
        older += 2 * part * rate(start + newer);
        older.swap(newer);
      }
      // Row j of the table, from the left: table[k] holds row j − 1's entry k until it is replaced.
      for (int k = 0; k < j; ++k) {
        const double ratio = static_cast<double>(j + 1) / (j - k);
        const StateVector extrapolated = newer + (newer - table[k]) / (ratio * ratio - 1);
        table[k] = std::exchange(newer, extrapolated);
      }
      table[j] = newer;
    }
    unflatten(start + table.back(), q_, v_);
  }

  void store() {
    state_.q = q_;
    state_.v = v_;
    for (std::size_t i = 0; i < v_.size(); ++i) state_.v[i].angular = q_[i].angular * v_[i].angular;
  }

  double step_;
  int order_;
  State state_;
  CoordinateVector q_;
  VelocityVector v_;  // local angular velocities
  ConstrainedDynamics dynamics_;
  EventDetection events_;
};

}  // namespace

std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order) {
  const Model model = build_model(scene);
  if (model.contacts) throw Error("it has contacts: its motion is not smooth");
  return std::make_unique<ReferenceIntegrator>(scene, model, step, order);
}

}  // namespace substep
