#pragma once
/// What is known of a scene's motion without simulating it: closed forms, invariants, published values, and
/// what must stand. A scene's file declares them in `extras.substep.expected`; see scenes/format.md.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

/// A number that a state has, of one body or of all.
enum class Quantity {
  displacement,             ///< distance of a body's centre of mass from its start, m
  position,                 ///< of its centre along `direction`, m
  way,                      ///< the same, counted from its start
  velocity,                 ///< of its centre along `direction`, m/s
  speed,                    ///< of its centre, m/s
  angular_velocity,         ///< about `direction`, rad/s
  angle,                    ///< by which a body has turned about `direction` since its start, rad
  azimuth,                  ///< by which its centre has gone round the axis, rad
  distance,                 ///< of its centre from the axis, m
  energy_change,            ///< of all bodies since the start, J
  momentum_change,          ///< of all bodies since the start but for gravity's, N·s
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
  peak,        ///< the `count`-th maximum that it rises to and falls from by a tenth of `tolerance` at least
  crossing,    ///< the time, in s, at which it goes through `level` for the `count`-th time
  stays,       ///< the time, in s, at which it first goes through `level`, or the run's end
};

/// The kind of comparison with the expected value.
enum class Bound { equal, at_most, at_least };

struct Expectation {
  std::string name;    ///< in words: "ball_4: height of bounce 2"
  std::string source;  ///< the closed form, or where the value was published
  Quantity quantity = Quantity::displacement;
  std::vector<int> bodies;  ///< of several the one counts that is furthest from what is expected
  int relative_to = 0;      ///< a body whose position, velocity or way is subtracted; 0 is the world
  Vector3 direction = Vector3::UnitY();  ///< unit; in the world, or in the body's node
  bool in_node = false;                  ///< whether `direction` turns with the body's node
  Vector3 centre = Vector3::Zero();      ///< a point of the axis, which `direction` is along, m
  Reading reading = Reading::throughout;
  double from = 0;  ///< s
  double to = 0;    ///< s; infinite: the run's end
  int count = 1;
  double level = 0;
  Bound bound = Bound::equal;
  double value = 0;
  double tolerance = 0;  ///< an error beyond it is bad; in the value's unit
  double needs = 0;      ///< s: in a shorter run there is nothing to compare
};

/// "m", "rad/s"; of a crossing "s".
const char* unit_of(const Expectation& expectation);

/// Returns the quantity's key in a file.
const char* name(Quantity quantity);

/// Returns the distance of `value` from the expected one: 0 within a bound, infinite if it is not finite.
double error_of(Bound bound, double expected, double value);

}  // namespace substep
