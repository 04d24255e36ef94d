#include "sim/measure/reference_integrator.h"

#include <Eigen/Core>
#include <vector>

#include "sim/algorithms.h"
#include "sim/error.h"
#include "sim/measure/constrained_dynamics.h"
#include "sim/measure/event_detection.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

constexpr int body_numbers = 13;   // position, quaternion, velocity, local angular velocity
constexpr double most_gap = 1e-4;  // of the scene's size: more is no rounding of the file's numbers
/// Tolerance of redundant rows; see ConstrainedDynamics::choose_rows. It exceeds the rounding of a file's
/// single-precision numbers. A mechanism that is closer to a singular position at the start of a step loses a
/// row for the step.
constexpr double rank_tolerance = 1e-6;
constexpr int most_events = 20;  // in one step

Model smooth_model(const Scene& scene) {
  Model model = build_model(scene);
  if (model.contacts) throw Error("it has contacts: its motion is not smooth");
  return model;
}

class ReferenceIntegrator : public Stepper {
 public:
  ReferenceIntegrator(const Scene& scene, double step, int order)
      : ReferenceIntegrator(scene, smooth_model(scene), step, order) {}

  bool step() override {
    start_q_ = q_;
    start_v_ = v_;
    double left = step_;
    for (int events = 0; events < most_events; ++events) {
      const double taken = advance_to_event(left);
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
  std::int64_t row_solves() const override { return dynamics_.row_solves(); }

 private:
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

  /// The state as numbers, and back; quaternions are of unit length only at the ends of steps.
  void flatten(const CoordinateVector& q, const VelocityVector& v, StateVector& y) const {
    y.resize(static_cast<Eigen::Index>(body_numbers * q.size()));
    for (std::size_t i = 0; i < q.size(); ++i) {
      y.segment<body_numbers>(body_numbers * i) << q[i].linear, q[i].angular.coeffs(), v[i].linear,
          v[i].angular;
    }
  }
  void unflatten(const StateVector& y, CoordinateVector& q, VelocityVector& v) const {
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
  void rate(const StateVector& y, StateVector& result) {
    unflatten(y, trial_q_, trial_v_);
    const VelocityVector& acceleration = dynamics_.accelerate(trial_q_, trial_v_);
    result.resize(y.size());
    for (std::size_t i = 0; i < trial_q_.size(); ++i) {
      const Vector3& spin = trial_v_[i].angular;
      // q' = ½ q ∘ ω̆, of the quaternion as it is.
      const Vector3 vector = y.segment<3>(body_numbers * i + 3);
      const double w = y[body_numbers * i + 6];
      result.segment<body_numbers>(body_numbers * i) << trial_v_[i].linear,
          0.5 * (w * spin + vector.cross(spin)), -0.5 * vector.dot(spin), acceleration[i].linear,
          acceleration[i].angular;
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

  double step_;
  int order_;
  State state_;
  CoordinateVector q_;
  VelocityVector v_;  // local angular velocities
  ConstrainedDynamics dynamics_;
  EventDetection events_;
  CoordinateVector start_q_;
  VelocityVector start_v_;
  CoordinateVector trial_q_;
  VelocityVector trial_v_;
  StateVector start_;
  StateVector start_rate_;
  StateVector point_;
  StateVector rate_;
  StateVector older_;
  StateVector newer_;
  StateVector previous_;
  StateVector extrapolated_;
  std::vector<StateVector> table_;
};

}  // namespace

std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order) {
  return std::make_unique<ReferenceIntegrator>(scene, step, order);
}

}  // namespace substep
