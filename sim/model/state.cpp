#include "sim/model/state.h"

#include <bit>
#include <cmath>
#include <type_traits>

#include "sim/math/floating_point.h"
#include "sim/math/fnv1a.h"
#include "sim/model/model.h"

namespace substep {
namespace {

/// A hash of numbers and of ranges of numbers, in the order in which they are added.
struct NumberHash {
  template <typename... Values>
  void add(const Values&... values) {
    (add_one(values), ...);
  }

  template <typename Value>
  void add_one(const Value& value) {
    if constexpr (std::is_arithmetic_v<Value>) {
      const double number = value + 0.0;  // −0 + 0 is 0
      hash = fnv1a_of_number(std::bit_cast<std::uint64_t>(number), 8, hash);
    } else {
      for (const double number : value) add_one(number);
    }
  }

  std::uint64_t hash = fnv1a_start;
};

}  // namespace

State initial_state(const Scene& scene) {
  State state;
  for (const Body& body : scene.bodies) {
    state.q.push_back({body.pose.position, body.pose.orientation});
    state.v.push_back({body.linear_velocity, body.angular_velocity});
  }
  return state;
}

std::uint64_t hash(const State& state) {
  const DefaultFloatingPoint environment;  // where a caller rounds downwards, −0 + 0 is −0
  NumberHash result;
  for (std::size_t body = 1; body < state.q.size(); ++body) {
    const Coordinates& q = state.q[body];
    const Velocity& v = state.v[body];
    result.add(q.linear, q.angular.w(), q.angular.vec(), v.linear, v.angular);
  }
  for (const ContactMemory& memory : state.contacts) {
    result.add(memory.collider_a, memory.collider_b, memory.slides, memory.left_over, memory.arm_a,
               memory.arm_b, memory.displacement);
    for (const Vector3& part : {memory.force, memory.stiffness}) {
      if (!part.isZero(0)) result.add(part);
    }
  }
  result.add(state.joint_forces);
  for (const PatchShape& patch : state.patches) {
    result.add(patch.a, patch.b, patch.collider_a, patch.collider_b, patch.corners, patch.slid, patch.arm_a,
               patch.arm_b, patch.position, patch.axes_in_a.reshaped(), patch.axes_in_b.reshaped(),
               patch.tilt, patch.left, patch.reference, patch.friction, patch.radius, patch.left_over,
               patch.margin);
    for (const double force : patch.force) {
      if (force != 0) result.add(force);
    }
    for (int k = 0; k < patch.corners; ++k) result.add(patch.corner[k]);
  }
  return result.hash;
}

bool is_finite(const State& state, int* body, const Model* model) {
  int first = -1;
  for (int i = 0; i < std::ssize(state.q); ++i) {
    const Coordinates& q = state.q[i];
    const Velocity& v = state.v[i];
    // Test the sum: it is finite only if its terms are. An overflow counts as not finite, too.
    const double sum = q.linear.sum() + q.angular.coeffs().sum() + v.linear.sum() + v.angular.sum();
    if (std::isfinite(sum)) continue;
    const bool is_moved = !model || moves(model->masses[i]);
    if (first < 0 || is_moved) first = i;
    if (is_moved) break;
  }
  if (first >= 0 && body) *body = first;
  return first < 0;
}

}  // namespace substep
