#pragma once
/// Expectations of a scene's motion that need no simulation: closed forms, invariants, published values, and
/// bodies that must remain standing. Files declare them in `extras.substep.expected`; see scenes/format.md.

#include <string>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// A number that follows from a state, of one body or of all.
enum class Quantity {
  displacement,             ///< distance of a body's centre of mass from its start, m
  position,                 ///< of a body's centre along `direction`, m
  way,                      ///< change of a body's position along `direction` since the start, m
  velocity,                 ///< of a body's centre along `direction`, m/s
  speed,                    ///< of a body's centre, m/s
  angular_velocity,         ///< about `direction`, rad/s
  angle,                    ///< rotation of a body about `direction` since the start, rad
  azimuth,                  ///< angle by which a body's centre has gone round the axis, rad
  distance,                 ///< of a body's centre from the axis, m
  energy_change,            ///< of all bodies since the start, J
  momentum_change,          ///< of all bodies since the start, less that of gravity, N·s
  angular_momentum_change,  ///< of all bodies about their common centre, N·m·s
  joint_gap,                ///< largest of the joints, m
  contact_impulse,          ///< of the step: |impulse along `direction`| summed over all contacts, N·s
  contact_work,             ///< of the step: largest |impulse · velocity| at a contact's point, J
};

/// The way to read one number off a quantity that changes with time.
enum class Reading {
  throughout,  ///< the value furthest from what is expected, from `from` to `to`
  at,          ///< the value at the time `from`
  mean,        ///< the mean from `from` to `to`
  peak,        ///< the `count`-th maximum, with a rise before and a fall after it of at least tolerance/10
  crossing,    ///< the time, in s, at which the value passes `level` for the `count`-th time
  stays,       ///< the time, in s, at which the value first passes `level`, else the run's end
};

/// The kind of comparison with the expected value.
enum class Bound { equal, at_most, at_least };

/// The expected value of one number of a run.
struct Expectation {
  std::string name;    ///< in words: "ball_4: height of bounce 2"
  std::string source;  ///< the closed form, or where the value was published
  Quantity quantity = Quantity::displacement;
  std::vector<int> bodies;               ///< the body whose value is furthest from the expected one counts
  int relative_to = 0;                   ///< a body whose value is subtracted; 0 is the world
  Vector3 direction = Vector3::UnitY();  ///< unit; in the world, or in the body's node
  bool in_node = false;                  ///< `direction` turns with the body's node
  Vector3 centre = Vector3::Zero();      ///< a point of the axis along `direction`, m
  Reading reading = Reading::throughout;
  double from = 0;   ///< s
  double to = 0;     ///< s; infinite: the run's end
  int count = 1;     ///< number of the peak or crossing, from 1
  double level = 0;  ///< of `crossing` and `stays`, in the quantity's unit
  Bound bound = Bound::equal;
  double value = 0;      ///< expected
  double tolerance = 0;  ///< largest error that is accepted; in the value's unit
  double needs = 0;      ///< shortest run that is compared, s
};

/// Returns the unit of the expected value: "m", "rad/s"; "s" where the reading is a time.
const char* unit_of(const Expectation& expectation);

/// Returns the quantity's key in a file.
const char* name(Quantity quantity);

/// Returns the distance of `value` from the expected one: 0 within a bound, infinite if it is not finite.
double error_of(Bound bound, double expected, double value);

}  // namespace substep
