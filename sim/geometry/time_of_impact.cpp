#include "sim/geometry/time_of_impact.h"

#include <algorithm>
#include <array>
#include <vector>

#include "sim/geometry/features.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// A simplex of at most four corners, and its point nearest to the origin.
struct Simplex {
  std::array<Vector3, 4> corners;
  int count = 0;
  Vector3 nearest = Vector3::Zero();
};

Simplex point_of(const Vector3& a) {
  return {{a}, 1, a};
}

/// Returns the part of a segment that is nearest to the origin.
Simplex nearest_of_segment(const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double length_squared = along.squaredNorm();
  const double part = -a.dot(along);
  if (!(part > 0)) return point_of(a);
  if (part >= length_squared) return point_of(b);
  const double weight = part / length_squared;
  return {{a, b}, 2, (1 - weight) * a + weight * b};
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
    // Take the nearest side of a triangle without area.
    const std::array<Simplex, 3> sides{nearest_of_segment(a, b), nearest_of_segment(a, c),
                                       nearest_of_segment(b, c)};
    return *std::ranges::min_element(sides, {},
                                     [](const Simplex& side) { return side.nearest.squaredNorm(); });
  }
  return {{a, b, c}, 3, area_a / area * a + area_b / area * b + area_c / area * c};
}

/// Returns the part of a tetrahedron that is nearest to the origin; all of it where it contains the origin.
Simplex nearest_of_tetrahedron(const std::array<Vector3, 4>& corners) {
  constexpr std::array<std::array<int, 4>, 4> faces{{{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}}};
  Simplex best;
  double least = infinity;
  bool is_outside = false;
  for (const auto& [i, j, k, opposite] : faces) {
    const Vector3& a = corners[i];
    const Vector3 normal = (corners[j] - a).cross(corners[k] - a);
    const double height_of_origin = -normal.dot(a);
    const double height_of_opposite = normal.dot(corners[opposite] - a);
    if (height_of_origin * height_of_opposite > 0) continue;
    is_outside = true;
    const Simplex face = nearest_of_triangle(a, corners[j], corners[k]);
    const double squared = face.nearest.squaredNorm();
    if (squared >= least) continue;
    least = squared;
    best = face;
  }
  if (is_outside) return best;
  return {corners, 4, Vector3::Zero()};
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

Pose pose_at(const MovingShape& moving, double time) {
  return moving.motion.at(time) * moving.placement;
}

/// Returns a plane's normal, and a solid's gap above the plane.
Separation above_plane(const Shape& shape, const Pose& pose, const Pose& plane) {
  const Vector3 normal = plane.orientation * Vector3::UnitY();
  const auto* polytope = std::get_if<Polytope>(&shape);
  if (polytope && polytope->ellipsoid) {
    const Vector3 local = pose.orientation.conjugate() * normal;
    return {normal,
            normal.dot(pose.position - plane.position) - local.cwiseProduct(*polytope->ellipsoid).norm()};
  }
  const ConvexSolid solid(shape, pose);
  return {normal, normal.dot(solid.support(-normal) - plane.position) - solid.radius()};
}

/// Returns an upper bound of the closing speed of a and b along `normal` (from b to a) between two times.
double closing_speed(const MovingShape& a, const MovingShape& b, const Vector3& normal, double from,
                     double to) {
  const double start = -normal.dot(a.motion.velocity - b.motion.velocity);
  // The velocity at the time s is v + (s + substep/2) a: linear in s.
  const auto linear = [&](double time) {
    return start - normal.dot((time + a.motion.substep / 2) * a.motion.acceleration -
                              (time + b.motion.substep / 2) * b.motion.acceleration);
  };
  return std::max(linear(from), linear(to)) + normal.cross(a.motion.spin).norm() * a.reach +
         normal.cross(b.motion.spin).norm() * b.reach;
}

/// Advances conservatively: by times in which the shapes cannot meet, until they are within the tolerance.
/// `separation_at` returns their separation at a time.
template <class SeparationAt>
std::optional<Impact> advance(const MovingShape& a, const MovingShape& b, double duration, double tolerance,
                              SeparationAt separation_at) {
  // A turning shape that misses by a fraction x of its reach takes about π/√x advances.
  constexpr int most_advances = 4000;
  double time = 0;
  Vector3 normal = Vector3::Zero();
  for (int i = 0; i < most_advances; ++i) {
    const Separation apart = separation_at(time);
    normal = apart.normal;
    if (apart.gap <= tolerance) return Impact{time, normal};
    const double speed = closing_speed(a, b, apart.normal, time, duration);
    // Keep half of the tolerance to spare.
    const double closed = apart.gap - tolerance / 2;
    // Leave a meeting at the very end to the next part of the step. A part ends at a meeting, so that
    // rounding would decide which of the two has it.
    constexpr double rounding = 1e-9;
    if (!(speed * (duration - time) > (1 + rounding) * closed)) return std::nullopt;
    time += closed / speed;
  }
  return Impact{time, normal};
}

thread_local std::vector<std::uint32_t> near_triangles;

/// Least cosine of the angle between directions of one surface that is curved or tilted a little.
constexpr double one_surface = 0.999;

std::optional<Impact> meets_mesh(const MovingShape& a, const TriangleMesh& mesh, const MovingShape& b,
                                 double duration, double tolerance, std::span<const ContactPoint> held) {
  // Find the triangles in the box around the path of a, in the frame of the mesh at its start.
  const Pose pose_b = pose_at(b, 0);
  const Bounds box = swept_bounds(a, duration);
  const Vector3 half = box.sizes() / 2;
  const Matrix3 to_mesh = pose_b.orientation.conjugate().toRotationMatrix();
  const Vector3 middle = to_mesh * (box.min() + half - pose_b.position);
  const double moved = b.motion.displacement(duration).norm() + duration * b.motion.spin.norm() * b.reach;
  const Vector3 reach = to_mesh.cwiseAbs() * half + Vector3::Constant(moved + tolerance);
  near_triangles.clear();
  find_triangles(mesh, {middle - reach, middle + reach}, near_triangles);
  const Vector3 start = pose_b.inverse() * ConvexSolid(*a.shape, pose_at(a, 0)).middle();
  double touching = infinity;
  for (const ContactPoint& point : held) touching = std::min(touching, point.distance + 2 * tolerance);
  std::optional<Impact> first;
  for (const std::uint32_t t : near_triangles) {
    const Triangle& corners = mesh.triangles[t];
    const bool is_behind = mesh.normals[t].dot(start - mesh.vertices[corners[0]]) < 0;
    if (!mesh.two_sided && is_behind) continue;
    const Vector3 front = pose_b.orientation * ((is_behind ? -1 : 1) * mesh.normals[t]);
    if (std::ranges::any_of(held,
                            [&](const ContactPoint& point) { return point.normal.dot(front) > one_surface; }))
      continue;
    const auto separation_at = [&](double time) {
      return separation(ConvexSolid(*a.shape, pose_at(a, time)),
                        ConvexSolid(mesh.vertices[corners[0]], mesh.vertices[corners[1]],
                                    mesh.vertices[corners[2]], pose_at(b, time)),
                        tolerance / 4);
    };
    if (!held.empty() && separation_at(0).gap <= touching) continue;
    const double until = first ? first->time : duration;
    if (const auto impact = advance(a, b, until, tolerance, separation_at)) first = impact;
  }
  return first;
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
  revolved_ = as_revolved(shape, pose);
  if (revolved_->is_ball_ended) {
    radius_ = std::min(revolved_->radius[0], revolved_->radius[1]);
    for (double& radius : revolved_->radius) radius -= radius_;
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
    Eigen::Index corner = 0;
    (corners_.transpose() * direction).maxCoeff(&corner);
    return corners_.col(corner);
  }
  const Vector3 local = rotation_.transpose() * direction;
  if (polytope_->half_box) {
    const Vector3 corner =
        polytope_->half_box->cwiseProduct(local.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; }));
    return position_ + rotation_ * corner;
  }
  return position_ + rotation_ * polytope_->vertices[farthest(polytope_->vertices, local).vertex];
}

Separation separation(const ConvexSolid& a, const ConvexSolid& b, double tolerance) {
  // The search approaches a curved surface step by step, to 1e-9 of the size within these steps.
  constexpr int most_steps = 64;
  const double radii = a.radius() + b.radius();
  Vector3 nearest = a.middle() - b.middle();
  if (nearest.squaredNorm() == 0) nearest = Vector3::UnitX();
  Simplex simplex;
  Separation best{Vector3::UnitY(), -infinity};
  for (int step = 0; step < most_steps; ++step) {
    const double distance = nearest.norm();
    if (!(distance > 0)) break;
    const Vector3 normal = nearest / distance;
    const Vector3 corner = a.support(-normal) - b.support(normal);
    const double gap = normal.dot(corner);
    if (gap > best.gap) best = {normal, gap};
    if (distance - best.gap <= tolerance && step > 0) break;
    simplex.corners[simplex.count++] = corner;
    simplex = nearest_of(simplex);
    if (simplex.count == 4) break;  // the cores overlap
    nearest = simplex.nearest;
  }
  return {best.normal, best.gap - radii};
}

Pose RigidMotion::at(double time) const {
  return {position + displacement(time), compose(rotation_quaternion(time * spin), orientation)};
}

std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, double duration,
                                     double tolerance, std::span<const ContactPoint> held) {
  const auto is_solid = [](const Shape& shape) {
    return !std::holds_alternative<Plane>(shape) && !std::holds_alternative<TriangleMesh>(shape);
  };
  if (!is_solid(*a.shape)) {
    if (!is_solid(*b.shape)) return std::nullopt;
    std::optional<Impact> impact = time_of_impact(b, a, duration, tolerance);
    if (impact) impact->normal = -impact->normal;
    return impact;
  }
  if (const auto* mesh = std::get_if<TriangleMesh>(b.shape))
    return meets_mesh(a, *mesh, b, duration, tolerance, held);
  if (std::holds_alternative<Plane>(*b.shape)) {
    return advance(a, b, duration, tolerance,
                   [&](double time) { return above_plane(*a.shape, pose_at(a, time), pose_at(b, time)); });
  }
  return advance(a, b, duration, tolerance, [&](double time) {
    return separation(ConvexSolid(*a.shape, pose_at(a, time)), ConvexSolid(*b.shape, pose_at(b, time)),
                      tolerance / 4);
  });
}

Bounds swept_bounds(const MovingShape& a, double duration) {
  const Bounds start = bounds(*a.shape, pose_at(a, 0));
  if (std::holds_alternative<Plane>(*a.shape)) return start;
  const Bounds end = bounds(*a.shape, pose_at(a, duration));
  // Between start and end a point leaves the chord by the sag of a parabola and of a circle, at most 2 reach.
  const double angle = duration * a.motion.spin.norm();
  const double sag =
      duration * duration * a.motion.acceleration.norm() / 8 + a.reach * std::min(2.0, angle * angle / 8);
  const Bounds both = start.merged(end);
  return {both.min() - Vector3::Constant(sag), both.max() + Vector3::Constant(sag)};
}

}  // namespace substep
