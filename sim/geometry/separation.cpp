#include "sim/geometry/separation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace substep {
namespace {

/// The corners of a simplex of at most four points, with the weights of its point nearest to the origin.
struct Simplex {
  std::array<Vector3, 4> corners;
  std::array<double, 4> weights;
  int count = 0;

  Vector3 nearest() const {
    Vector3 sum = Vector3::Zero();
    for (int i = 0; i < count; ++i) sum += weights[i] * corners[i];
    return sum;
  }
};

Simplex point_of(const Vector3& a) {
  return {{a}, {1}, 1};
}

/// Returns the part of a segment that is nearest to the origin.
Simplex nearest_of_segment(const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double length_squared = along.squaredNorm();
  const double part = -a.dot(along);
  if (!(part > 0)) return point_of(a);
  if (part >= length_squared) return point_of(b);
  const double weight = part / length_squared;
  return {{a, b}, {1 - weight, weight}, 2};
}

/// Returns the part of a triangle that is nearest to the origin (Ericson, Real-Time Collision
/// Detection, 5.1.5).
Simplex nearest_of_triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const double a_along_ab = -ab.dot(a);
  const double a_along_ac = -ac.dot(a);
  if (a_along_ab <= 0 && a_along_ac <= 0) return point_of(a);
  const double b_along_ab = -ab.dot(b);
  const double b_along_ac = -ac.dot(b);
  if (b_along_ab >= 0 && b_along_ac <= b_along_ab) return point_of(b);
  const double c_along_ab = -ab.dot(c);
  const double c_along_ac = -ac.dot(c);
  if (c_along_ac >= 0 && c_along_ab <= c_along_ac) return point_of(c);
  const double area_c = a_along_ab * b_along_ac - b_along_ab * a_along_ac;
  if (area_c <= 0 && a_along_ab >= 0 && b_along_ab <= 0) return nearest_of_segment(a, b);
  const double area_b = c_along_ab * a_along_ac - a_along_ab * c_along_ac;
  if (area_b <= 0 && a_along_ac >= 0 && c_along_ac <= 0) return nearest_of_segment(a, c);
  const double area_a = b_along_ab * c_along_ac - c_along_ab * b_along_ac;
  if (area_a <= 0 && b_along_ac - b_along_ab >= 0 && c_along_ab - c_along_ac >= 0)
    return nearest_of_segment(b, c);
  const double area = area_a + area_b + area_c;
  if (!(area > 0)) {
    // Without an area, the nearest of its sides.
    const std::array<Simplex, 3> sides{nearest_of_segment(a, b), nearest_of_segment(a, c),
                                       nearest_of_segment(b, c)};
    return *std::ranges::min_element(sides, {},
                                     [](const Simplex& side) { return side.nearest().squaredNorm(); });
  }
  return {{a, b, c}, {area_a / area, area_b / area, area_c / area}, 3};
}

/// Returns the part of a tetrahedron that is nearest to the origin; all of it where it holds the origin.
Simplex nearest_of_tetrahedron(const std::array<Vector3, 4>& corners) {
  constexpr std::array<std::array<int, 4>, 4> faces{{{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}}};
  Simplex best;
  double least = std::numeric_limits<double>::infinity();
  bool is_outside = false;
  for (const auto& [i, j, k, opposite] : faces) {
    const Vector3& a = corners[i];
    const Vector3 normal = (corners[j] - a).cross(corners[k] - a);
    const double height_of_origin = -normal.dot(a);
    const double height_of_opposite = normal.dot(corners[opposite] - a);
    if (height_of_origin * height_of_opposite > 0) continue;
    is_outside = true;
    const Simplex face = nearest_of_triangle(a, corners[j], corners[k]);
    const double squared = face.nearest().squaredNorm();
    if (squared >= least) continue;
    least = squared;
    best = face;
  }
  if (is_outside) return best;
  return {corners, {0.25, 0.25, 0.25, 0.25}, 4};
}

Simplex nearest_of(const Simplex& simplex) {
  switch (simplex.count) {
    case 1:
      return point_of(simplex.corners[0]);
    case 2:
      return nearest_of_segment(simplex.corners[0], simplex.corners[1]);
    case 3:
      return nearest_of_triangle(simplex.corners[0], simplex.corners[1], simplex.corners[2]);
    default:
      return nearest_of_tetrahedron(simplex.corners);
  }
}

}  // namespace

ConvexSolid::ConvexSolid(const Shape& shape, const Pose& pose) {
  if (const auto* polytope = std::get_if<Polytope>(&shape)) {
    polytope_ = polytope;
    rotation_ = pose.orientation.toRotationMatrix();
    position_ = pose.position;
    middle_ = position_ + rotation_ * polytope->centre;
    return;
  }
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    radius_ = sphere->radius;
    revolved_.emplace(Sphere{0}, pose);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    radius_ = capsule->radius;
    revolved_.emplace(Capsule{capsule->half_length, 0}, pose);
  } else if (const auto* tapered = std::get_if<TaperedCapsule>(&shape)) {
    radius_ = std::min(tapered->radius_bottom, tapered->radius_top);
    revolved_.emplace(
        TaperedCapsule{tapered->half_length, tapered->radius_bottom - radius_, tapered->radius_top - radius_},
        pose);
  } else {
    revolved_.emplace(std::get<Cylinder>(shape), pose);
  }
  middle_ = pose.position;
}

ConvexSolid::ConvexSolid(const Vector3& a, const Vector3& b, const Vector3& c, const Pose& pose) {
  corners_ << pose * a, pose * b, pose * c;
  middle_ = corners_.rowwise().mean();
}

Vector3 ConvexSolid::support(const Vector3& direction) const {
  if (revolved_) return revolved_->support(direction.normalized());
  if (!polytope_) {
    Eigen::Index farthest = 0;
    (corners_.transpose() * direction).maxCoeff(&farthest);
    return corners_.col(farthest);
  }
  const Vector3 local = rotation_.transpose() * direction;
  if (polytope_->box) {
    const OrientedBox& box = *polytope_->box;
    const Vector3 in_box = box.pose.orientation.conjugate() * local;
    const Vector3 corner =
        box.half_size.cwiseProduct(in_box.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; }));
    return position_ + rotation_ * (box.pose * corner);
  }
  const Vector3* farthest = &polytope_->vertices[0];
  double height = local.dot(*farthest);
  for (const Vector3& vertex : polytope_->vertices) {
    const double other = local.dot(vertex);
    if (other <= height) continue;
    height = other;
    farthest = &vertex;
  }
  return position_ + rotation_ * *farthest;
}

Separation separation(const ConvexSolid& a, const ConvexSolid& b, double tolerance) {
  // The search approaches a curved surface step by step: more are never needed to 1e-9 of the size.
  constexpr int most_steps = 64;
  const double radii = a.radius() + b.radius();
  Vector3 nearest = a.middle() - b.middle();
  if (nearest.squaredNorm() == 0) nearest = Vector3::UnitX();
  Simplex simplex;
  Separation best{Vector3::UnitY(), -std::numeric_limits<double>::infinity()};
  for (int step = 0; step < most_steps; ++step) {
    const double distance = nearest.norm();
    if (!(distance > 0)) break;
    const Vector3 normal = nearest / distance;
    const Vector3 corner = a.support(-normal) - b.support(normal);
    const double gap = normal.dot(corner);
    if (gap > best.gap) best = {normal, gap};
    if (distance - best.gap <= tolerance && step > 0) break;
    const bool is_known = std::any_of(simplex.corners.begin(), simplex.corners.begin() + simplex.count,
                                      [&](const Vector3& other) { return other == corner; });
    if (is_known) break;
    simplex.corners[simplex.count++] = corner;
    simplex = nearest_of(simplex);
    if (simplex.count == 4) break;  // the cores overlap
    nearest = simplex.nearest();
  }
  return {best.normal, best.gap - radii};
}

}  // namespace substep
