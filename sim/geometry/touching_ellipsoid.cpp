#include "sim/geometry/touching_ellipsoid.h"

#include <cmath>
#include <utility>
#include <variant>

namespace substep {
namespace {

/// Squared sine of the angle within which a point lies where the normal meets the surface.
constexpr double same_direction = 1e-6;

/// Squared sine of the angle between axis and normal from which on a cylinder rolls on a circle. One that
/// stands has several points, and they stay where they are.
constexpr double leans = 1e-6;

/// Of its radius: a point lies on a ball.
constexpr double same_radius = 1e-6;

bool lies_along(const Vector3& arm, const Vector3& normal) {
  return arm.dot(normal) < 0 &&
         arm.cross(normal).squaredNorm() <= same_direction * arm.squaredNorm() * normal.squaredNorm();
}

TouchingEllipsoid ball(double y, double radius) {
  return {{0, y, 0}, Vector3::Constant(radius * radius)};
}

struct SurfaceAt {
  const Shape& other;
  Vector3 point;
  Vector3 normal;

  std::optional<TouchingEllipsoid> operator()(const Sphere& sphere) const { return ball(0, sphere.radius); }
  std::optional<TouchingEllipsoid> operator()(const Capsule& capsule) const {
    return of_balls(capsule.half_length, capsule.radius, capsule.radius);
  }
  std::optional<TouchingEllipsoid> operator()(const TaperedCapsule& capsule) const {
    return of_balls(capsule.half_length, capsule.radius_bottom, capsule.radius_top);
  }
  std::optional<TouchingEllipsoid> operator()(const Cylinder&) const { return circle(); }
  std::optional<TouchingEllipsoid> operator()(const Polytope& polytope) const {
    // An ellipsoid is its hull to all other shapes.
    if (!polytope.ellipsoid || !std::holds_alternative<Plane>(other)) return std::nullopt;
    return TouchingEllipsoid{Vector3::Zero(), polytope.ellipsoid->cwiseAbs2()};
  }
  std::optional<TouchingEllipsoid> operator()(const Plane&) const { return std::nullopt; }
  std::optional<TouchingEllipsoid> operator()(const TriangleMesh&) const { return std::nullopt; }

 private:
  std::optional<TouchingEllipsoid> of_balls(double half_length, double bottom, double top) const {
    for (const auto& [y, radius] : {std::pair{-half_length, bottom}, std::pair{half_length, top}}) {
      const Vector3 arm = point - Vector3(0, y, 0);
      if (std::abs(arm.norm() - radius) < same_radius * radius && lies_along(arm, normal))
        return ball(y, radius);
    }
    return circle();
  }
  std::optional<TouchingEllipsoid> circle() const {
    const Vector3 radial(point.x(), 0, point.z());
    const Vector3 across(normal.x(), 0, normal.z());
    if (across.squaredNorm() < leans || !lies_along(radial, across)) return std::nullopt;
    return TouchingEllipsoid{{0, point.y(), 0}, radial.squaredNorm() * Vector3(1, 0, 1)};
  }
};

}  // namespace

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
  return std::visit(SurfaceAt{other, point, normal}, shape);
}

}  // namespace substep
