#include "sim/model/state.h"

#include <bit>
#include <cmath>

#include "sim/math/floating_point.h"
#include "sim/math/fnv1a.h"

namespace substep {
namespace {

void add(std::uint64_t& hash, double value) {
  hash = fnv1a_of_number(std::bit_cast<std::uint64_t>(value + 0.0), 8, hash);  // −0 + 0 is 0
}

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
  const DefaultFloatingPoint environment;  // rounding downwards, −0 + 0 is −0
  std::uint64_t hash = fnv1a_start;
  for (std::size_t body = 1; body < state.q.size(); ++body) {
    const Coordinates& q = state.q[body];
    const Velocity& v = state.v[body];
    for (const double value : {q.linear.x(), q.linear.y(), q.linear.z(), q.angular.w(), q.angular.x(),
                               q.angular.y(), q.angular.z(), v.linear.x(), v.linear.y(), v.linear.z(),
                               v.angular.x(), v.angular.y(), v.angular.z()}) {
      add(hash, value);
    }
  }
  for (const ContactMemory& memory : state.contacts) {
    add(hash, memory.collider_a);
    add(hash, memory.collider_b);
    add(hash, memory.slides ? 1 : 0);
    add(hash, memory.left_over);
    for (const Vector3& part : {memory.arm_a, memory.arm_b, memory.displacement}) {
      for (int k = 0; k < 3; ++k) add(hash, part[k]);
    }
    for (const Vector3& part : {memory.force, memory.stiffness}) {
      for (int k = 0; k < 3 && !part.isZero(0); ++k) add(hash, part[k]);
    }
  }
  for (const double force : state.joint_forces) add(hash, force);
  for (const PatchShape& patch : state.patches) {
    for (const int value :
         {patch.a, patch.b, patch.collider_a, patch.collider_b, patch.corners, patch.slid ? 1 : 0}) {
      add(hash, value);
    }
    for (const Vector3& part : {patch.arm_a, patch.arm_b, patch.position}) {
      for (int k = 0; k < 3; ++k) add(hash, part[k]);
    }
    for (const Matrix3& axes : {patch.axes_in_a, patch.axes_in_b}) {
      for (int k = 0; k < 9; ++k) add(hash, axes.data()[k]);
    }
    for (const double value : {patch.tilt[0], patch.tilt[1], patch.left[0], patch.left[1], patch.left[2],
                               patch.reference[0], patch.reference[1], patch.reference[2], patch.friction,
                               patch.radius, patch.left_over, patch.margin}) {
      add(hash, value);
    }
    for (const double force : patch.force) {
      if (force != 0) add(hash, force);
    }
    for (int k = 0; k < patch.corners; ++k) {
      for (const double place : patch.corner[k]) add(hash, place);
    }
  }
  return hash;
}

bool is_finite(const State& state, int* body) {
  // The world comes last: an impulse that is not finite reaches it with the body that diverged.
  for (std::size_t k = 1; k <= state.q.size(); ++k) {
    const std::size_t i = k % state.q.size();
    const Coordinates& q = state.q[i];
    const Velocity& v = state.v[i];
    // A sum is finite only if its terms are, up to overflow, which counts as not finite just as well.
    const double sum = q.linear.sum() + q.angular.coeffs().sum() + v.linear.sum() + v.angular.sum();
    if (!std::isfinite(sum)) {
      if (body) *body = static_cast<int>(i);
      return false;
    }
  }
  return true;
}

}  // namespace substep
