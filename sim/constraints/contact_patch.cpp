#include "sim/constraints/contact_patch.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/geometry/features.h"

namespace substep {
namespace {

/// Largest distance of a flat manifold's gap from the plane through all gaps, relative to the patch's radius.
/// A step may be divided into short parts, in which an error of a gap becomes a fast velocity.
constexpr double flatness = 1e-10;

/// Distance from a side within which a corner is left out, relative to the patch's radius.
constexpr double collinear = 1e-6;

/// The normal equations of planes through values at a manifold's points.
struct PlaneFit {
  void add(double x, double y) {
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }

  /// Returns the slopes of the plane through values with these moments. Points on a line have one along it.
  std::array<double, 2> slopes(double along_x, double along_y) const {
    if (!(trace() > 0)) return {0, 0};
    const double determinant = xx * yy - xy * xy;
    if (determinant > 1e-12 * trace() * trace()) {
      return {(yy * along_x - xy * along_y) / determinant, (xx * along_y - xy * along_x) / determinant};
    }
    return {along_x / trace(), along_y / trace()};
  }

  double trace() const { return xx + yy; }

  double xx = 0;
  double xy = 0;
  double yy = 0;
};

/// A point along the tangents of a patch, m.
struct PatchPoint {
  double x;
  double y;
  auto operator<=>(const PatchPoint&) const = default;
};

/// Sets the shape's corners to the hull of the points, counter-clockwise; to none where there are too many.
void set_patch_corners(int count, double tolerance, std::array<PatchPoint, most_in_manifold> points,
                       PatchShape& shape) {
  std::sort(points.begin(), points.begin() + count);
  std::array<PatchPoint, 2 * most_in_manifold> hull;
  const std::size_t size =
      planar_hull(std::span<const PatchPoint>(points.data(), count), tolerance, hull.data());
  shape.corners = size > most_corners ? 0 : static_cast<int>(size);
  for (int i = 0; i < shape.corners; ++i) {
    shape.corner[i][0] = hull[i].x;
    shape.corner[i][1] = hull[i].y;
  }
}

/// Returns true where a contact has friction, no impact and no round or rolling surface.
bool can_be_in_patch(const Contact& contact) {
  return contact.restitution == Contact::no_impact && contact.friction > 0 && !contact.rolls_a &&
         !contact.rolls_b && !contact.turns_with_a && !contact.turns_with_neither;
}

/// A manifold's points in a patch's axes, and the means over them.
struct PatchPoints {
  std::array<PatchPoint, most_in_manifold> position{};
  double gap[most_in_manifold];  ///< along the normal, m
  double mean_gap = 0;
  double mean_left = 0;      ///< of the overlaps that later steps recover, m
  double moved[2] = {0, 0};  ///< mean displacement of friction along the tangents, m
  double radius = 0;         ///< mean distance from the centre, m
  PlaneFit fit;
};

/// Returns a shape with the contacts' mean arms and friction and largest overlap, and the first's axes.
PatchShape start_shape(const Contact* contacts, int count, const Coordinates& a, const Coordinates& b) {
  PatchShape shape{};
  shape.arm_a = shape.arm_b = Vector3::Zero();
  for (int i = 0; i < count; ++i) {
    shape.arm_a += contacts[i].arm_a / count;
    shape.arm_b += contacts[i].arm_b / count;
    shape.friction += contacts[i].friction / count;
    shape.slid = shape.slid || contacts[i].slid;
    shape.left_over = std::max(shape.left_over, contacts[i].left_over + contacts[i].gap_offset);
  }
  const bool is_one_pair = std::all_of(contacts, contacts + count, [&](const Contact& contact) {
    return contact.collider_a == contacts->collider_a && contact.collider_b == contacts->collider_b;
  });
  shape.a = contacts->a;
  shape.b = contacts->b;
  shape.collider_a = is_one_pair ? contacts->collider_a : -1;
  shape.collider_b = is_one_pair ? contacts->collider_b : -1;
  shape.margin = contacts->margin;
  shape.axes_in_b << contacts->normal_b, contacts->tangent_b1, contacts->tangent_b2;
  shape.position = b.angular.conjugate() * (a.linear - b.linear);
  shape.turn = b.angular.conjugate() * a.angular;
  shape.axes_in_a = (a.angular.conjugate() * b.angular).toRotationMatrix() * shape.axes_in_b;
  return shape;
}

/// Returns the points in the patch's axes, and the means over them.
PatchPoints measure_points(const Contact* contacts, int count, const PatchShape& shape) {
  PatchPoints points;
  for (int i = 0; i < count; ++i) {
    const Contact& contact = contacts[i];
    const Vector3 on_b = contact.arm_b - shape.arm_b;
    const Vector3 on_a = contact.arm_a - shape.arm_a;
    const double x = shape.axes_in_b.col(1).dot(on_b);
    const double y = shape.axes_in_b.col(2).dot(on_b);
    points.position[i] = {x, y};
    points.gap[i] = shape.axes_in_a.col(0).dot(on_a) - shape.axes_in_b.col(0).dot(on_b);
    points.mean_gap += points.gap[i] / count;
    points.mean_left += (contact.left_over + contact.gap_offset) / count;
    points.moved[0] += contact.displacement_1 / count;
    points.moved[1] += contact.displacement_2 / count;
    points.radius += std::sqrt(x * x + y * y) / count;
    points.fit.add(x, y);
  }
  return points;
}

/// Fits planes to the gaps and to the overlaps left over, and a motion to the displacements. Returns false
/// where a gap is not on the plane.
bool fit_planes(const Contact* contacts, int count, const PatchPoints& points, PatchShape& shape) {
  double gap_moments[2] = {0, 0};
  double left_moments[2] = {0, 0};
  double twist = 0;
  for (int i = 0; i < count; ++i) {
    const Contact& contact = contacts[i];
    const auto [x, y] = points.position[i];
    const double gap = points.gap[i] - points.mean_gap;
    const double left = contact.left_over + contact.gap_offset - points.mean_left;
    gap_moments[0] += x * gap;
    gap_moments[1] += y * gap;
    left_moments[0] += x * left;
    left_moments[1] += y * left;
    twist += x * (contact.displacement_2 - points.moved[1]) - y * (contact.displacement_1 - points.moved[0]);
  }
  const auto tilt = points.fit.slopes(gap_moments[0], gap_moments[1]);
  const auto left_tilt = points.fit.slopes(left_moments[0], left_moments[1]);
  for (int i = 0; i < count; ++i) {
    const auto [x, y] = points.position[i];
    const double plane =
        points.mean_gap + points.mean_left + (tilt[0] + left_tilt[0]) * x + (tilt[1] + left_tilt[1]) * y;
    const double of_point = points.gap[i] + contacts[i].left_over + contacts[i].gap_offset;
    if (!(std::abs(of_point - plane) <= flatness * points.radius)) return false;
  }
  for (int k = 0; k < 2; ++k) {
    shape.tilt[k] = tilt[k];
    shape.left[k + 1] = left_tilt[k];
    shape.reference[k] = points.moved[k];
  }
  shape.left[0] = points.mean_left;
  shape.reference[2] = points.fit.trace() > 0 ? twist / points.fit.trace() : 0;
  shape.radius = points.radius;
  return true;
}

/// Moves the arms of a tilted patch along the normal to its least gap, where the bodies touch and friction
/// acts. At the mean gap friction would turn the bodies by another lever.
void lower_to_touch(const Contact* contacts, int count, const PatchPoints& points, PatchShape& shape) {
  const auto lowest = std::min_element(points.gap, points.gap + count) - points.gap;
  const double lower = points.gap[lowest] - points.mean_gap;
  if (!(lower < -flatness * points.radius)) return;
  const auto move = [](const Vector3& normal, const Vector3& to, Vector3& arm) {
    arm += normal.dot(to - arm) * normal;
  };
  move(shape.axes_in_a.col(0), contacts[lowest].arm_a, shape.arm_a);
  move(shape.axes_in_b.col(0), contacts[lowest].arm_b, shape.arm_b);
  shape.left[0] -= lower;
}

/// Sums the points' forces up to one wrench at the patch's centre.
void add_forces(const Contact* contacts, int count, const PatchPoints& points, PatchShape& shape) {
  for (int i = 0; i < count; ++i) {
    const Vector3& force = contacts[i].force;
    const auto [x, y] = points.position[i];
    const double wrench[6] = {force[0], y * force[0], -x * force[0],
                              force[1], force[2],     x * force[2] - y * force[1]};
    for (int k = 0; k < 6; ++k) shape.force[k] += wrench[k];
  }
}

}  // namespace

std::optional<PatchShape> patch_shape(const Contact* contacts, int count, const Coordinates& a,
                                      const Coordinates& b) {
  if (!std::all_of(contacts, contacts + count, can_be_in_patch)) return std::nullopt;
  PatchShape shape = start_shape(contacts, count, a, b);
  const PatchPoints points = measure_points(contacts, count, shape);
  if (!fit_planes(contacts, count, points, shape)) return std::nullopt;
  lower_to_touch(contacts, count, points, shape);
  add_forces(contacts, count, points, shape);
  set_patch_corners(count, collinear * points.radius, points.position, shape);
  if (shape.corners < 2) return std::nullopt;
  return shape;
}

}  // namespace substep
