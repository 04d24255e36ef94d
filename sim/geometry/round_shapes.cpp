#include "sim/geometry/round_shapes.h"

#include <algorithm>
#include <cmath>

#include "sim/error.h"

namespace substep {
namespace {

/// Squared sine of the angle within which a point lies where the normal meets the surface.
constexpr double same_direction = 1e-6;

/// Squared sine of the angle between axis and normal above which a cylinder rolls on a circle. A standing
/// cylinder has several contact points, which do not roll.
constexpr double leans = 1e-6;

/// Fraction of its radius within which a point lies on a ball.
constexpr double same_radius = 1e-6;

bool lies_along(const Vector3& arm, const Vector3& normal) {
  return arm.dot(normal) < 0 &&
         arm.cross(normal).squaredNorm() <= same_direction * arm.squaredNorm() * normal.squaredNorm();
}

}  // namespace

Cylinder make_cylinder(double height, double radius_bottom, double radius_top) {
  const Cylinder cylinder{height / 2, radius_bottom, radius_top};
  if (!as_revolved(cylinder, {})->is_valid())
    throw Error("a cylinder needs a positive height and radii that are not both 0");
  return cylinder;
}

TaperedCapsule make_tapered_capsule(double height, double radius_bottom, double radius_top) {
  const TaperedCapsule capsule{height / 2, radius_bottom, radius_top};
  if (!as_revolved(capsule, {})->is_valid())
    throw Error("a tapered capsule needs a height that is not negative and radii that are not both 0");
  return capsule;
}

RevolvedSolid::RevolvedSolid(const Pose& pose, double half_length, double radius_bottom, double radius_top,
                             bool has_ball_ends)
    : middle(pose.position),
      axis(pose.orientation * Vector3::UnitY()),
      across(pose.orientation * Vector3::UnitX()),
      half(half_length),
      radius{radius_bottom, radius_top},
      is_ball_ended(has_ball_ends) {
  const double difference = radius_bottom - radius_top;
  if (is_ball_ended) {
    has_side = std::abs(difference) < 2 * half;
    if (has_side) sine = difference / (2 * half);
    cosine = std::sqrt(1 - sine * sine);
  } else {
    const double slant = std::sqrt(4 * half * half + difference * difference);
    sine = difference / slant;
    cosine = 2 * half / slant;
  }
}

bool RevolvedSolid::is_valid() const {
  const double radii = radius[0] + radius[1];
  return std::isfinite(half) && (is_ball_ended ? half >= 0 : half > 0) && std::isfinite(radii) && radii > 0 &&
         radius[0] >= 0 && radius[1] >= 0;
}

double RevolvedSolid::reach() const {
  const double largest = std::max(radius[0], radius[1]);
  return is_ball_ended ? half + largest : std::sqrt(half * half + largest * largest);
}

Vector3 RevolvedSolid::support(const Vector3& direction, int i) const {
  if (is_ball_ended) return end(i) + radius[i] * direction;
  const Vector3 out = outward(direction);
  const double length = out.norm();
  // Take a disc's centre for a direction along the axis, in which all its points are equally far.
  if (length <= 1e-12) return end(i);
  // Project once more: a direction nearly along the axis is not yet perpendicular to it.
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
  // Measure in the half-plane (distance, y) along the side's line, from its foot.
  const double foot = is_ball_ended ? 0 : radius[0];
  const double along = -sine * (distance - foot) + cosine * (y + half);
  const double length =
      is_ball_ended ? 2 * half * cosine : -sine * (radius[1] - radius[0]) + cosine * 2 * half;
  // Test the discs first: over the wider disc of a flat cone the point's foot lies on the side's line too.
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

std::optional<RevolvedSolid> as_revolved(const Shape& shape, const Pose& pose) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    return RevolvedSolid(pose, 0, sphere->radius, sphere->radius, true);
  }
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    return RevolvedSolid(pose, capsule->half_length, capsule->radius, capsule->radius, true);
  }
  if (const auto* tapered = std::get_if<TaperedCapsule>(&shape)) {
    return RevolvedSolid(pose, tapered->half_length, tapered->radius_bottom, tapered->radius_top, true);
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    return RevolvedSolid(pose, cylinder->half_height, cylinder->radius_bottom, cylinder->radius_top, false);
  }
  return std::nullopt;
}

bool is_round(const Shape& shape) {
  return std::holds_alternative<Sphere>(shape) || std::holds_alternative<Capsule>(shape) ||
         std::holds_alternative<TaperedCapsule>(shape);
}

bool is_curved(const Shape& shape) {
  const auto* polytope = std::get_if<Polytope>(&shape);
  return is_round(shape) || std::holds_alternative<Cylinder>(shape) || (polytope && polytope->ellipsoid);
}

std::optional<TouchingEllipsoid> touching_ellipsoid(const Shape& shape, const Shape& other,
                                                    const Vector3& point, const Vector3& normal) {
  if (const auto* polytope = std::get_if<Polytope>(&shape)) {
    // Against all other shapes an ellipsoid is its hull, which is flat.
    if (!polytope->ellipsoid || !std::holds_alternative<Plane>(other)) return std::nullopt;
    return TouchingEllipsoid{Vector3::Zero(), polytope->ellipsoid->cwiseAbs2()};
  }
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    return TouchingEllipsoid{Vector3::Zero(), Vector3::Constant(sphere->radius * sphere->radius)};
  }
  const std::optional<RevolvedSolid> solid = as_revolved(shape, {});
  if (!solid) return std::nullopt;
  for (int end = 0; end < 2 && solid->is_ball_ended; ++end) {
    const double radius = solid->radius[end];
    const Vector3 centre(0, end == 0 ? -solid->half : solid->half, 0);
    const Vector3 arm = point - centre;
    if (std::abs(arm.norm() - radius) < same_radius * radius && lies_along(arm, normal)) {
      return TouchingEllipsoid{centre, Vector3::Constant(radius * radius)};
    }
  }
  const Vector3 radial(point.x(), 0, point.z());
  const Vector3 across(normal.x(), 0, normal.z());
  if (across.squaredNorm() < leans || !lies_along(radial, across)) return std::nullopt;
  return TouchingEllipsoid{{0, point.y(), 0}, radial.squaredNorm() * Vector3(1, 0, 1)};
}

}  // namespace substep
