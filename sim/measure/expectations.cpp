#include "sim/measure/expectations.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "sim/math/rotation.h"
#include "sim/measure/invariants.h"
#include "sim/measure/motion.h"

namespace substep {
namespace {

constexpr double same_time = 1e-9;  // s; rounding allowed when times are compared
constexpr double least_rise = 0.1;  // smallest rise to and fall from a counted maximum, of the tolerance

/// Returns the bodies of an expectation; the world for one of the whole scene.
std::vector<int> bodies_of(const Expectation& expectation) {
  return expectation.bodies.empty() ? std::vector{world_body} : expectation.bodies;
}

bool is_of_contacts(Quantity quantity) {
  return quantity == Quantity::contact_impulse || quantity == Quantity::contact_work;
}

/// Returns the largest |impulse · relative velocity| of the contacts' points.
double largest_work(const State& state, const std::vector<ContactImpulse>& contacts) {
  double largest = 0;
  for (const ContactImpulse& contact : contacts) {
    const auto velocity = [&](int body) -> Vector3 {
      const auto index = static_cast<std::size_t>(body);
      return state.v[index].linear + state.v[index].angular.cross(contact.point - state.q[index].linear);
    };
    const double work = contact.impulse.dot(velocity(contact.a) - velocity(contact.b));
    largest = std::max(largest, std::abs(work));
  }
  return largest;
}

/// A quantity of one body, or of the scene, from state to state.
class QuantityOfBody {
 public:
  QuantityOfBody(const Scene& scene, const Expectation& expectation, int body, const State& start)
      : scene_(scene), e_(expectation), body_(static_cast<std::size_t>(body)), start_(start) {
    const Vector3& along = e_.direction;
    const Vector3 arm = radial(start);
    // Count azimuths from the start's arm, or from some normal of the axis where the start is on it.
    outwards_ = arm.norm() > 0 ? arm.normalized() : along.unitOrthogonal();
    sideways_ = along.cross(outwards_);
    if (e_.quantity == Quantity::joint_gap) gap_.emplace(scene);
    if (e_.quantity == Quantity::energy_change) energy_ = energy(scene, start);
    if (e_.quantity == Quantity::momentum_change || e_.quantity == Quantity::angular_momentum_change)
      momentum_ = momentum(scene, start, 0);
  }

  double value(const State& state, double time, const std::vector<ContactImpulse>* contacts) {
    if (is_of_contacts(e_.quantity) && !contacts) return infinity;
    const Coordinates& q = state.q[body_];
    const Velocity& v = state.v[body_];
    const auto other = static_cast<std::size_t>(e_.relative_to);
    const Vector3 position = q.linear - state.q[other].linear;
    switch (e_.quantity) {
      case Quantity::displacement:
        return (q.linear - start_.q[body_].linear).norm();
      case Quantity::position:
        return position.dot(e_.direction);
      case Quantity::way:
        return (position - start_.q[body_].linear + start_.q[other].linear).dot(e_.direction);
      case Quantity::velocity:
        return (v.linear - state.v[other].linear).dot(e_.direction);
      case Quantity::speed:
        return v.linear.norm();
      case Quantity::angular_velocity:
        return v.angular.dot(axis(state));
      case Quantity::angle:
        return unwind(turned(state), v.angular.dot(e_.direction), time);
      case Quantity::azimuth: {
        const Vector3 arm = radial(state);
        const double angle = angle_of(arm.dot(sideways_), arm.dot(outwards_));
        // Divide by the longer of the last two arms: a body that passes the axis closely turns by less than
        // π.
        const double squared = std::max(arm.squaredNorm(), std::exchange(squared_arm_, arm.squaredNorm()));
        return unwind(angle, squared > 0 ? arm.cross(v.linear).dot(e_.direction) / squared : 0, time);
      }
      case Quantity::distance:
        return radial(state).norm();
      case Quantity::energy_change:
        return energy(scene_, state) - energy_;
      case Quantity::momentum_change:
        return (momentum(scene_, state, time).linear - momentum_.linear).norm();
      case Quantity::angular_momentum_change:
        return (momentum(scene_, state, time).angular - momentum_.angular).norm();
      case Quantity::joint_gap:
        return gap_->gap(state);
      case Quantity::contact_impulse:
        return std::accumulate(contacts->begin(), contacts->end(), 0.0,
                               [&](double sum, const ContactImpulse& contact) {
                                 return sum + std::abs(contact.impulse.dot(e_.direction));
                               });
      case Quantity::contact_work:
        return largest_work(state, *contacts);
    }
    return 0;
  }

 private:
  /// Returns the angle that is one of `angle` + 2π k and nearest to the last one turned on at `rate`, rad.
  double unwind(double angle, double rate, double time) {
    const double predicted = angle_ + rate * (time - std::exchange(time_, time));
    return angle_ = predicted + std::remainder(angle - predicted, 2 * std::numbers::pi);
  }

  /// Returns the vector from the axis to the body's centre.
  Vector3 radial(const State& state) const {
    const Vector3 arm = state.q[body_].linear - e_.centre;
    return arm - arm.dot(e_.direction) * e_.direction;
  }

  Vector3 axis(const State& state) const {
    if (!e_.in_node) return e_.direction;
    return state.q[body_].angular * (scene_.bodies[body_].body_from_node.orientation * e_.direction);
  }

  /// Returns the twist about the direction in the rotation since the start, in [−2π, 2π].
  double turned(const State& state) const {
    const Quaternion turn = state.q[body_].angular * start_.q[body_].angular.conjugate();
    return 2 * angle_of(turn.vec().dot(e_.direction), turn.w());
  }

  const Scene& scene_;
  const Expectation& e_;
  std::size_t body_;
  const State& start_;
  Vector3 outwards_;
  Vector3 sideways_;
  double energy_ = 0;
  Momentum momentum_;
  double angle_ = 0;        // rad, at the last state
  double time_ = 0;         // s, of the last state
  double squared_arm_ = 0;  // m², at the last state
  std::optional<JointGapMeter> gap_;
};

/// Reads one number off a quantity.
class Reader {
 public:
  /// `start`: the value at time 0.
  Reader(const Expectation& expectation, double start)
      : e_(expectation), last_(start), side_(side_of(start)), lowest_(start), highest_(start) {
    const bool starts = e_.reading == Reading::throughout && !is_of_contacts(e_.quantity);
    if (e_.reading == Reading::at || starts) add(0, start);
  }

  void add(double time, double value) {
    if (!done_) {
      switch (e_.reading) {
        case Reading::at:
          add_at(time, value);
          break;
        case Reading::crossing:
        case Reading::stays:
          add_crossing(time, value);
          break;
        case Reading::peak:
          add_peak(value);
          break;
        case Reading::mean:
          if (is_within(last_time_) && is_within(time)) {
            sum_ += (last_ + value) / 2 * (time - last_time_);
            summed_ += time - last_time_;
          }
          break;
        case Reading::throughout:
          if (is_within(time)) keep_furthest(value);
          break;
      }
    }
    last_time_ = time;
    last_ = value;
  }

  /// Returns the number: infinite where the event did not happen or the run diverged before `to`. For `stays`
  /// without a crossing it is the last state's time.
  double result(bool diverged) const {
    if (e_.reading == Reading::mean) {
      const bool is_whole = last_time_ >= e_.to - same_time || !diverged;
      return is_whole && summed_ > 0 ? sum_ / summed_ : infinity;
    }
    if (e_.reading == Reading::stays) return found_.value_or(last_time_);
    if (e_.reading == Reading::throughout && diverged && !(last_time_ >= e_.to - same_time)) return infinity;
    return found_.value_or(infinity);
  }

 private:
  bool is_within(double time) const { return time >= e_.from - same_time && time <= e_.to + same_time; }

  void finish(double value) {
    found_ = value;
    done_ = true;
  }

  void add_at(double time, double value) {
    if (time < e_.from - same_time) return;
    // Interpolate linearly between two steps.
    const double share = time > e_.from + same_time ? (e_.from - last_time_) / (time - last_time_) : 1;
    finish(last_ + share * (value - last_));
  }

  int side_of(double value) const { return (value > e_.level) - (value < e_.level); }

  void add_crossing(double time, double value) {
    if (value == infinity) return finish(infinity);  // the contacts are not known
    const int side = side_of(value);
    if (side == 0) return;
    if (side_ != 0 && side != side_ && ++count_ == e_.count) {
      const double share = (e_.level - last_) / (value - last_);
      finish(last_time_ + share * (time - last_time_));
    }
    side_ = side;
  }

  /// Counts a maximum once the quantity has risen to it and fallen from it by a tenth of the tolerance;
  /// smaller oscillations have none.
  void add_peak(double value) {
    if (is_rising_) {
      highest_ = std::max(highest_, value);
      if (value > highest_ - least_rise * e_.tolerance) return;
      is_rising_ = false;
      lowest_ = value;
      if (++count_ == e_.count) finish(highest_);
    } else {
      lowest_ = std::min(lowest_, value);
      if (value < lowest_ + least_rise * e_.tolerance) return;
      is_rising_ = true;
      highest_ = value;
    }
  }

  void keep_furthest(double value) {
    const auto beyond = [&](double x) {
      if (e_.bound == Bound::at_most) return x;
      return e_.bound == Bound::at_least ? -x : std::fabs(x - e_.value);
    };
    if (!found_ || beyond(value) > beyond(*found_)) found_ = value;
  }

  const Expectation& e_;
  bool done_ = false;
  double last_time_ = 0;
  double last_;
  double sum_ = 0;     // of trapezoids
  double summed_ = 0;  // s
  int count_ = 0;
  int side_;
  bool is_rising_ = false;
  double lowest_;
  double highest_;
  std::optional<double> found_;
};

}  // namespace

/// An expectation, and how it is measured on each of its bodies.
struct ExpectationMeter::Figure {
  struct Series {
    QuantityOfBody quantity;
    Reader reader;
  };
  Expectation expectation;
  std::vector<Series> series = {};
};

ExpectationMeter::ExpectationMeter(const Scene& scene, const State& start) : start_(start) {
  for (const Expectation& expectation : scene.expected) {
    if (expectation.needs <= scene.duration + same_time) figures_.push_back({expectation});
  }
  // Series refer to their figure's expectation, which keeps its address from here on.
  const std::vector<ContactImpulse> none;
  for (Figure& figure : figures_) {
    for (const int body : bodies_of(figure.expectation)) {
      QuantityOfBody quantity(scene, figure.expectation, body, start_);
      const double at_start = quantity.value(start, 0, &none);
      figure.series.push_back({std::move(quantity), Reader(figure.expectation, at_start)});
    }
  }
}

ExpectationMeter::~ExpectationMeter() = default;

bool ExpectationMeter::needs_contacts() const {
  return std::ranges::any_of(
      figures_, [](const Figure& figure) { return is_of_contacts(figure.expectation.quantity); });
}

void ExpectationMeter::add(const State& state, double time, const std::vector<ContactImpulse>* contacts) {
  for (Figure& figure : figures_) {
    for (Figure::Series& series : figure.series)
      series.reader.add(time, series.quantity.value(state, time, contacts));
  }
}

std::vector<ExpectedFigure> ExpectationMeter::figures(bool diverged) const {
  std::vector<ExpectedFigure> result;
  for (const Figure& figure : figures_) {
    const Expectation& e = figure.expectation;
    ExpectedFigure worst{e.name, unit_of(e), e.bound, e.value, e.tolerance, 0};
    bool is_first = true;
    for (const Figure::Series& series : figure.series) {
      ExpectedFigure own = worst;
      own.measured = series.reader.result(diverged);
      // Keep the worst value: the closest to a bound or farthest beyond it, since errors within it are 0.
      const bool is_beyond = e.bound == Bound::at_most    ? own.measured > worst.measured
                             : e.bound == Bound::at_least ? own.measured < worst.measured
                                                          : own.error() > worst.error();
      if (is_first || !std::isfinite(own.measured) || (std::isfinite(worst.measured) && is_beyond))
        worst = own;
      is_first = false;
    }
    result.push_back(std::move(worst));
  }
  return result;
}

std::string bounded_text(Bound bound, const std::string& value) {
  if (bound == Bound::at_most) return "≤ " + value;
  return bound == Bound::at_least ? "≥ " + value : value;
}

const Expectation* expectation_of_poses(const Scene& scene) {
  const auto found = std::ranges::find_if(scene.expected, [](const Expectation& e) {
    // The value of these two is a time.
    if (e.reading == Reading::crossing || e.reading == Reading::stays) return false;
    return e.quantity == Quantity::displacement || e.quantity == Quantity::position ||
           e.quantity == Quantity::way || e.quantity == Quantity::angle || e.quantity == Quantity::azimuth ||
           e.quantity == Quantity::distance || e.quantity == Quantity::joint_gap;
  });
  return found == scene.expected.end() ? nullptr : &*found;
}

PoseReader reader_of(const Scene& scene, const Expectation& expectation) {
  // The quantities refer to the start, which keeps its address.
  const auto start = std::make_shared<const State>(initial_state(scene));
  std::vector<QuantityOfBody> quantities;
  for (const int body : bodies_of(expectation)) quantities.emplace_back(scene, expectation, body, *start);
  return [&expectation, start, quantities, state = *start](const std::vector<Coordinates>& poses) mutable {
    state.q = poses;
    double furthest = expectation.value;
    for (QuantityOfBody& quantity : quantities) {
      const double value = quantity.value(state, 0, nullptr);
      const bool is_further =
          !(std::abs(value - expectation.value) <= std::abs(furthest - expectation.value));
      if (is_further) furthest = value;
    }
    return furthest;
  };
}

}  // namespace substep
