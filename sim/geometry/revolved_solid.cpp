#include "sim/geometry/revolved_solid.h"

#include <algorithm>
#include <cmath>

namespace substep {

RevolvedSolid::RevolvedSolid(const Pose& pose, double half_length, double radius_bottom, double radius_top,
                             bool balls)
    : middle(pose.position),
      axis(pose.orientation * Vector3::UnitY()),
      across(pose.orientation * Vector3::UnitX()),
      half(half_length),
      radius{radius_bottom, radius_top},
      is_ball_ended(balls) {
  const double difference = radius_bottom - radius_top;
  if (balls) {
    has_side = std::abs(difference) < 2 * half;
    if (has_side) sine = difference / (2 * half);
    cosine = std::sqrt(1 - sine * sine);
  } else {
    const double slant = std::sqrt(4 * half * half + difference * difference);
    sine = difference / slant;
    cosine = 2 * half / slant;
  }
}

RevolvedSolid::RevolvedSolid(const Sphere& sphere, const Pose& pose)
    : RevolvedSolid(pose, 0, sphere.radius, sphere.radius, true) {}

RevolvedSolid::RevolvedSolid(const Capsule& capsule, const Pose& pose)
    : RevolvedSolid(pose, capsule.half_length, capsule.radius, capsule.radius, true) {}

RevolvedSolid::RevolvedSolid(const TaperedCapsule& capsule, const Pose& pose)
    : RevolvedSolid(pose, capsule.half_length, capsule.radius_bottom, capsule.radius_top, true) {}

RevolvedSolid::RevolvedSolid(const Cylinder& cylinder, const Pose& pose)
    : RevolvedSolid(pose, cylinder.half_height, cylinder.radius_bottom, cylinder.radius_top, false) {}

double RevolvedSolid::reach() const {
  const double largest = std::max(radius[0], radius[1]);
  return is_ball_ended ? half + largest : std::sqrt(half * half + largest * largest);
}

Vector3 RevolvedSolid::support(const Vector3& direction, int i) const {
  if (is_ball_ended) return end(i) + radius[i] * direction;
  const Vector3 out = outward(direction);
  const double length = out.norm();
  // Straight along the axis the whole disc is farthest: its centre stands for it.
  if (length <= 1e-12) return end(i);
  // Once more, as what was nearly along the axis is not quite across it.
  return end(i) + radius[i] * outward(out / length).normalized();
}

Vector3 RevolvedSolid::support(const Vector3& direction) const {
  const Vector3 bottom = support(direction, 0);
  const Vector3 top = support(direction, 1);
  return direction.dot(bottom) > direction.dot(top) ? bottom : top;
}

double RevolvedSolid::height(const Vector3& direction) const {
  const double along = axis.dot(direction);
  const double out = is_ball_ended ? 1 : outward(direction).norm();
  return direction.dot(middle) + std::max(-half * along + radius[0] * out, half * along + radius[1] * out);
}

std::optional<Vector3> RevolvedSolid::direction_to(const Vector3& point) const {
  const Vector3 from = point - middle;
  const double y = axis.dot(from);
  const Vector3 out = from - y * axis;
  const double distance = out.norm();
  const Vector3 u = distance > 0 ? Vector3(out / distance) : across;
  // In the half-plane (distance, y): how far along the side's line and how far from it.
  const double foot = is_ball_ended ? 0 : radius[0];
  const double along = -sine * (distance - foot) + cosine * (y + half);
  const double length =
      is_ball_ended ? 2 * half * cosine : -sine * (radius[1] - radius[0]) + cosine * 2 * half;
  // Over the wider disc of a flat cone the side's line has the point's foot, too: from within.
  const bool is_over_disc = !is_ball_ended && distance <= radius[y > 0 ? 1 : 0] && std::abs(y) > half;
  if (is_over_disc) return y > 0 ? axis : Vector3(-axis);
  if (has_side && along > 0 && along < length) return cosine * u + sine * axis;
  const int i = has_side ? (along > 0 ? 1 : 0) : (radius[1] > radius[0] ? 1 : 0);
  if (is_ball_ended) {
    const Vector3 to = point - end(i);
    const double length_to = to.norm();
    if (length_to == 0) return std::nullopt;
    return to / length_to;
  }
  const double beyond = i == 0 ? y + half : y - half;
  if (distance <= radius[i]) return std::nullopt;
  return ((distance - radius[i]) * u + beyond * axis).normalized();
}

}  // namespace substep
