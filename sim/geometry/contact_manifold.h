#pragma once
/// Contacts of two features of shapes, such as a disc and a polygon, along a given normal.

#include <array>
#include <span>
#include <vector>

#include "sim/geometry/closest_points.h"
#include "sim/geometry/contact.h"
#include "sim/geometry/revolved_solid.h"

namespace substep {

/// Fraction of the size by which a corner may lie outside a side and still count as inside, so that flush
/// faces keep their corners.
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

/// The feature of a revolved solid that faces `direction`: one of its discs, or the line along its side, from
/// bottom to top, of points farthest along `direction`.
struct RevolvedFeature {
  bool is_disc = false;
  Disc disc{};
  Segment line{};
};

/// Returns 8 points of the rim at equal angles. One of them is the deepest below a plane with this normal or,
/// where the disc is parallel to the plane to 1e-5, lies at the disc's own `across`.
std::array<Vector3, 8> rim_points(const Disc& disc, const Vector3& plane_normal);

/// Returns the line of points of a solid's side farthest along `direction` where its ends are equally far to
/// within `near`; else the farthest point, twice.
Segment line_or_point(const RevolvedSolid& solid, const Vector3& direction, double near);

RevolvedFeature feature_towards(const RevolvedSolid& solid, const Vector3& direction);

/// Collects the contacts of features of a and b along `normal` (unit, from b to a) below the margin.
class Manifold {
 public:
  /// `size`: of the smaller shape, for tolerances.
  Manifold(const Vector3& normal, double size, double margin, std::vector<ContactPoint>& out)
      : normal_(normal), size_(size), margin_(margin), out_(out) {}

  /// Adds points of the disc's rim, corners of the polygon over the disc, and crossings of the two outlines.
  void add(const Disc& a, const Polygon& b) { add_disc_polygon(a, b, false); }
  void add(const Polygon& a, const Disc& b) { add_disc_polygon(b, a, true); }
  void add(const Disc& a, const Disc& b);
  /// Adds two contacts, at the ends of the part of the line that is over the other feature.
  void add(const Disc& a, const Segment& b) { add_disc_segment(a, b, false); }
  void add(const Segment& a, const Disc& b) { add_disc_segment(b, a, true); }
  void add(const Segment& a, const Polygon& b);
  /// Adds the corners of the common part. One polygon is the reference, whose plane is perpendicular to the
  /// normal.
  void add(const Polygon& a, const Polygon& b, bool reference_is_b);
  /// Adds the ends of the part along which the segments are beside each other, if they are parallel to within
  /// `preference`; else adds nothing and returns false.
  bool add_beside(const Segment& a, const Segment& b, double preference);
  /// Adds the closest points of segments, which may be points. Adds nothing and returns false where these are
  /// not opposite to each other.
  bool add_crossing(const Segment& a, const Segment& b);
  /// Adds a contact at a point of a and the opposite point of b along the normal.
  void add_point(const Vector3& on_a, double distance);

 private:
  void add_disc_polygon(const Disc& disc, const Polygon& polygon, bool polygon_is_a);
  void add_disc_segment(const Disc& disc, const Segment& line, bool line_is_a);
  /// Returns the collected contacts in their order around the disc; of points nearer than `near` to each
  /// other one.
  void push_round(double near, bool swapped);
  bool is_across(const Vector3& gap, double tolerance) const;
  void push(const Vector3& one, const Vector3& other, bool swapped);

  Vector3 normal_;
  double size_;
  double margin_;
  std::vector<ContactPoint>& out_;
};

}  // namespace substep
