#include "sim/geometry/time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/geometry/separation.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

Pose pose_at(const MovingShape& moving, double time) {
  return moving.motion.at(time) * moving.placement;
}

/// Returns the direction along which a solid is above a plane, and by how much.
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

/// Returns a bound of the speed at which a and b close along `normal` (from b to a) between two times.
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

/// Advances by times in which the two cannot meet, until they are within the tolerance. `separation_at`
/// returns how they are apart at a time.
template <class SeparationAt>
std::optional<Impact> advance(const MovingShape& a, const MovingShape& b, double duration, double tolerance,
                              SeparationAt separation_at) {
  // A miss by a thousandth of the size at a turn of 1 rad takes about 70 advances.
  constexpr int most_advances = 400;
  double time = 0;
  Vector3 normal = Vector3::Zero();
  for (int i = 0; i < most_advances; ++i) {
    const Separation apart = separation_at(time);
    normal = apart.normal;
    if (apart.gap <= tolerance) return Impact{time, normal};
    const double speed = closing_speed(a, b, apart.normal, time, duration);
    // At the end of the duration there is half of the tolerance to spare.
    const double room = apart.gap - tolerance / 2;
    if (!(speed * (duration - time) > room)) return std::nullopt;
    time += room / speed;
  }
  return Impact{time, normal};
}

std::vector<std::uint32_t>& near_triangles() {
  thread_local std::vector<std::uint32_t> memory;
  return memory;
}

std::optional<Impact> meets_mesh(const MovingShape& a, const TriangleMesh& mesh, const MovingShape& b,
                                 double duration, double tolerance) {
  // The box around the way of a, as the mesh sees it at its start.
  const Pose pose_b = pose_at(b, 0);
  const Bounds box = swept_bounds(a, duration);
  const Vector3 half = (box.upper - box.lower) / 2;
  const Matrix3 to_mesh = pose_b.orientation.conjugate().toRotationMatrix();
  const Vector3 middle = to_mesh * (box.lower + half - pose_b.position);
  const double moved = b.motion.displacement(duration).norm() + duration * b.motion.spin.norm() * b.reach;
  const Vector3 reach = to_mesh.cwiseAbs() * half + Vector3::Constant(moved + tolerance);
  std::vector<std::uint32_t>& triangles = near_triangles();
  triangles.clear();
  find_triangles(mesh, {middle - reach, middle + reach}, triangles);
  const Vector3 start = pose_b.inverse() * ConvexSolid(*a.shape, pose_at(a, 0)).middle();
  std::optional<Impact> first;
  for (const std::uint32_t t : triangles) {
    const Triangle& corners = mesh.triangles[t];
    if (!mesh.two_sided && mesh.normals[t].dot(start - mesh.vertices[corners[0]]) < 0) continue;
    const auto separation_at = [&](double time) {
      return separation(ConvexSolid(*a.shape, pose_at(a, time)),
                        ConvexSolid(mesh.vertices[corners[0]], mesh.vertices[corners[1]],
                                    mesh.vertices[corners[2]], pose_at(b, time)),
                        tolerance / 4);
    };
    const double until = first ? first->time : duration;
    if (const auto impact = advance(a, b, until, tolerance, separation_at)) first = impact;
  }
  return first;
}

}  // namespace

Pose RigidMotion::at(double time) const {
  return {position + displacement(time), compose(rotation_quaternion(time * spin), orientation)};
}

std::optional<Impact> time_of_impact(const MovingShape& a, const MovingShape& b, double duration,
                                     double tolerance) {
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
    return meets_mesh(a, *mesh, b, duration, tolerance);
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
  Bounds swept{start.lower.cwiseMin(end.lower), start.upper.cwiseMax(end.upper)};
  swept.lower.array() -= sag;
  swept.upper.array() += sag;
  return swept;
}

}  // namespace substep
