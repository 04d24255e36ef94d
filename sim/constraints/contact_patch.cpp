#include "sim/constraints/contact_patch.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace substep {
namespace {

/// Flatness, relative to the patch's radius: a manifold with a gap farther than this from the plane through
/// all is not flat. A step may be taken in short parts, in which what a gap is wrong by becomes a fast
/// velocity.
constexpr double flatness = 1e-10;

/// Distance from a side within which a corner is left out, relative to the patch's radius.
constexpr double collinear = 1e-6;

/// Normal equations of planes through values at a manifold's points.
class PlaneFit {
 public:
  void add(double x, double y) {
    xx_ += x * x;
    xy_ += x * y;
    yy_ += y * y;
  }

  /// Returns the slopes of the plane through values with these moments. Points on a line have one along it.
  std::array<double, 2> slopes(double along_x, double along_y) const {
    const double trace = xx_ + yy_;
    if (!(trace > 0)) return {0, 0};
    const double determinant = xx_ * yy_ - xy_ * xy_;
    if (determinant > 1e-12 * trace * trace) {
      return {(yy_ * along_x - xy_ * along_y) / determinant, (xx_ * along_y - xy_ * along_x) / determinant};
    }
    return {along_x / trace, along_y / trace};
  }

  double trace() const { return xx_ + yy_; }

 private:
  double xx_ = 0;
  double xy_ = 0;
  double yy_ = 0;
};

using Point = std::array<double, 2>;

/// Makes the counterclockwise hull of the points. Returns how many corners it has; 0 where there are too
/// many.
int make_hull(int count, double tolerance, std::array<Point, most_in_manifold> points,
              double (&corner)[most_corners][2]) {
  std::sort(points.begin(), points.begin() + count);
  std::array<Point, 2 * most_in_manifold> hull;
  int size = 0;
  const auto add = [&](const Point& p, int least) {
    // Remove corners that are not to the right of the way from the one before them to this.
    while (size >= least) {
      const Point& from = hull[size - 2];
      const Point& over = hull[size - 1];
      const double ux = over[0] - from[0];
      const double uy = over[1] - from[1];
      const double wx = p[0] - from[0];
      const double wy = p[1] - from[1];
      if (ux * wy - uy * wx > tolerance * std::sqrt(wx * wx + wy * wy)) break;
      --size;
    }
    hull[size++] = p;
  };
  for (int i = 0; i < count; ++i) add(points[i], 2);
  const int lower = size + 1;
  for (int i = count - 2; i >= 0; --i) add(points[i], lower);
  --size;  // the first once more
  if (size > most_corners) return 0;
  for (int i = 0; i < size; ++i) {
    corner[i][0] = hull[i][0];
    corner[i][1] = hull[i][1];
  }
  return size;
}

bool is_flat_surface(const Contact& contact) {
  return contact.restitution == Contact::no_impact && contact.friction > 0 && !contact.rolls_a &&
         !contact.rolls_b && !contact.turns_with_a && !contact.turns_with_neither;
}

/// A manifold's points in a patch's axes, and the means over them.
struct PatchPoints {
  std::array<Point, most_in_manifold> position{};
  double gap[most_in_manifold];
  double mean_gap = 0;
  double mean_left = 0;
  double moved[2] = {0, 0};
  double radius = 0;
  PlaneFit fit;
};

/// Returns a shape with the means over its contacts, and axes by the first.
PatchShape start_shape(const Contact* contacts, int count, const Coordinates& a, const Coordinates& b) {
  PatchShape shape;
  shape.arm_a = shape.arm_b = Vector3::Zero();
  shape.friction = shape.left_over = 0;
  shape.slid = shape.is_kept = false;
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

/// Places the points in the patch's axes, and takes the means over them.
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

/// Fits planes to the gaps and to what is added to them, and a motion to the displacements. Returns false
/// where a gap is beside its plane.
bool fit_planes(const Contact* contacts, int count, const PatchPoints& points, PatchShape& shape) {
  double gap_moments[2] = {0, 0};
  double left_moments[2] = {0, 0};
  double twist = 0;
  for (int i = 0; i < count; ++i) {
    const Contact& contact = contacts[i];
    const Point& position = points.position[i];
    for (int k = 0; k < 2; ++k) {
      gap_moments[k] += position[k] * (points.gap[i] - points.mean_gap);
      left_moments[k] += position[k] * (contact.left_over + contact.gap_offset - points.mean_left);
    }
    twist += position[0] * (contact.displacement_2 - points.moved[1]) -
             position[1] * (contact.displacement_1 - points.moved[0]);
  }
  const auto tilt = points.fit.slopes(gap_moments[0], gap_moments[1]);
  const auto left_tilt = points.fit.slopes(left_moments[0], left_moments[1]);
  for (int i = 0; i < count; ++i) {
    const Point& position = points.position[i];
    const double plane = points.mean_gap + points.mean_left + (tilt[0] + left_tilt[0]) * position[0] +
                         (tilt[1] + left_tilt[1]) * position[1];
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
  if (!std::all_of(contacts, contacts + count, is_flat_surface)) return std::nullopt;
  PatchShape shape = start_shape(contacts, count, a, b);
  const PatchPoints points = measure_points(contacts, count, shape);
  if (!fit_planes(contacts, count, points, shape)) return std::nullopt;
  add_forces(contacts, count, points, shape);
  shape.corners = make_hull(count, collinear * points.radius, points.position, shape.corner);
  if (shape.corners < 2) return std::nullopt;
  return shape;
}

}  // namespace substep
