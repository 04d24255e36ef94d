#pragma once
/// The contacts of two features of shapes, such as a disc and a polygon, along a normal that is known.

#include <array>
#include <span>
#include <vector>

#include "sim/geometry/closest_points.h"
#include "sim/geometry/contact.h"
#include "sim/geometry/revolved_solid.h"

namespace substep {

/// A corner this part of the size outside a side counts as inside: faces that are flush keep their corners.
constexpr double flush_share = 1e-9;

/// The flat end of a cylinder.
struct Disc {
  Vector3 centre;
  Vector3 normal;  ///< unit, outward
  Vector3 across;  ///< unit, in the disc's plane, fixed in the shape
  double radius;
};

/// A planar convex polygon, counter-clockwise seen from outside.
struct Polygon {
  std::span<const Vector3> corners;
  Vector3 normal;  ///< unit, outward
  /// For each side, whether the surface goes on in the same plane behind it; empty where it nowhere does.
  std::span<const bool> goes_on;
};

Disc end_disc(const RevolvedSolid& solid, int end);

/// A feature that a revolved solid turns towards `direction`: one of its discs, or else the line along its
/// side, from its bottom to its top, of points farthest along `direction`.
struct RevolvedFeature {
  bool is_disc = false;
  Disc disc{};
  Segment line{};
};

/// 8 points of the rim at equal angles, one of them the deepest below a plane with this normal or, where the
/// disc is parallel to it to 1e-5, at the disc's own `across`.
std::array<Vector3, 8> rim_points(const Disc& disc, const Vector3& plane_normal);

/// The line of points of a solid's side farthest along `direction` if its ends are equally far to within
/// `near`; else the farthest point, twice.
Segment line_or_point(const RevolvedSolid& solid, const Vector3& direction, double near);

RevolvedFeature feature_towards(const RevolvedSolid& solid, const Vector3& direction);

/// Collects the contacts of features of a and b along `normal` (unit, from b to a) below the margin.
class Manifold {
 public:
  /// `size`: of the smaller shape, for tolerances.
  Manifold(const Vector3& normal, double size, double margin, std::vector<ContactPoint>& out)
      : normal_(normal), size_(size), margin_(margin), out_(out) {}

  /// Points of the disc's rim, corners of the polygon over the disc, crossings of the two outlines.
  void add(const Disc& a, const Polygon& b) { add_disc_polygon(a, b, false); }
  void add(const Polygon& a, const Disc& b) { add_disc_polygon(b, a, true); }
  void add(const Disc& a, const Disc& b);
  /// Two contacts: at the ends of the part of the line over the other.
  void add(const Disc& a, const Segment& b) { add_disc_segment(a, b, false); }
  void add(const Segment& a, const Disc& b) { add_disc_segment(b, a, true); }
  void add(const Segment& a, const Polygon& b);
  /// The corners of the common part. One of the two is the reference, whose plane is across the normal.
  void add(const Polygon& a, const Polygon& b, bool reference_is_b);
  /// The ends of the part along which the segments are beside each other, if there they are parallel to
  /// within `preference`; else false, and nothing added.
  bool add_beside(const Segment& a, const Segment& b, double preference);
  /// The closest points of segments, which may be points. False, and nothing added, if these do not lie
  /// across from each other.
  bool add_crossing(const Segment& a, const Segment& b);
  /// Of a point of a and the point of b across from it along the normal.
  void add_point(const Vector3& on_a, double distance);

 private:
  void add_disc_polygon(const Disc& disc, const Polygon& polygon, bool polygon_is_a);
  void add_disc_segment(const Disc& disc, const Segment& line, bool line_is_a);
  /// What has been collected, in the order round the disc, points nearer than `near` to each other once.
  void push_round(double near, bool swapped);
  bool is_across(const Vector3& gap, double tolerance) const;
  void push(const Vector3& one, const Vector3& other, bool swapped);

  Vector3 normal_;
  double size_;
  double margin_;
  std::vector<ContactPoint>& out_;
};

}  // namespace substep
