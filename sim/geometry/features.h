#pragma once
/// Features of shapes (segments, discs, polygons): their closest points, and their contacts along a normal.

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/round_shapes.h"

namespace substep {

/// Returns a root on [0, 1] of a continuous function that is positive at 0 and negative at 1.
template <class Function>
double find_root(Function function) {
  double low = 0;
  double high = 1;
  double at_low = function(low);
  double at_high = function(high);
  if (!(at_low > 0)) return 0;
  if (!(at_high < 0)) return 1;
  // Iterate the Illinois variant of false position.
  int side = 0;
  for (int i = 0; i < 60 && high - low > 1e-15; ++i) {
    double middle = (low * at_high - high * at_low) / (at_high - at_low);
    if (!(middle > low && middle < high)) middle = (low + high) / 2;
    const double value = function(middle);
    if (value == 0) return middle;
    if (value > 0) {
      low = middle;
      at_low = value;
      if (side == 1) at_high /= 2;
      side = 1;
    } else {
      high = middle;
      at_high = value;
      if (side == -1) at_low /= 2;
      side = -1;
    }
    if (middle == low && middle == high) break;
  }
  return (low + high) / 2;
}

/// Fraction of the size by which a corner may lie outside a side and still count as inside, so that flush
/// faces keep their corners.
constexpr double flush_fraction = 1e-9;

struct Segment {
  Vector3 from;
  Vector3 to;
};

/// The positions of closest points as fractions of the way along each segment, in [0, 1].
struct SegmentParameters {
  double on_a;
  double on_b;
};

inline Vector3 point_at(const Segment& segment, double parameter) {
  return segment.from + parameter * (segment.to - segment.from);
}

/// Returns the position of the point of `segment` closest to `point`, as a fraction in [0, 1]; 0 for a
/// segment without length.
double closest_parameter(const Segment& segment, const Vector3& point);

/// Returns one of the closest pairs of points. Segments may be points, parallel or crossing.
SegmentParameters closest_parameters(const Segment& a, const Segment& b);

/// The closest of several pairs of points.
struct ClosestPair {
  double squared_distance = infinity;
  Vector3 on_a = Vector3::Zero();
  Vector3 on_b = Vector3::Zero();

  /// Takes two points if they are closer; returns false if they are not.
  bool consider(const Vector3& of_a, const Vector3& of_b) {
    const double squared = (of_a - of_b).squaredNorm();
    if (!(squared < squared_distance)) return false;
    *this = {squared, of_a, of_b};
    return true;
  }
  /// Takes the closest points of two segments if they are closer; returns false if they are not.
  bool consider(const Segment& of_a, const Segment& of_b) {
    const SegmentParameters closest = closest_parameters(of_a, of_b);
    return consider(point_at(of_a, closest.on_a), point_at(of_b, closest.on_b));
  }
};

/// The largest component of points along a direction, and the index of the first point that has it.
struct Extent {
  double height = -infinity;
  std::uint32_t vertex = 0;
};

/// Returns the extent of points along a direction.
inline Extent farthest(std::span<const Vector3> points, const Vector3& direction) {
  Extent extent;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double height = direction.dot(points[i]);
    if (!(height <= extent.height)) extent = {height, i};
  }
  return extent;
}

/// Shortens the interval [low, high] of a segment to its part in a half-space, from the distances of the
/// segment's ends from the half-space. Returns false if nothing is left.
inline bool cut_interval(double from, double to, double tolerance, double& low, double& high) {
  if (from > tolerance && to > tolerance) return false;
  if (from > tolerance) low = std::max(low, from / (from - to));
  if (to > tolerance) high = std::min(high, from / (from - to));
  return low <= high;
}

/// A convex polygon that is cut by planes in turn, and keeps its memory for the next.
struct CutPolygon {
  CutPolygon() = default;
  /// Reserves memory for `most` corners, since shapes that lie flat in the first step may be cut later.
  explicit CutPolygon(std::size_t most) {
    corners.reserve(most);
    kept.reserve(most);
    distances.reserve(most);
  }

  std::vector<Vector3> corners;
  std::vector<Vector3> kept;
  std::vector<double> distances;

  /// Removes all corners. Gives both buffers the size of the larger, since they swap at each cut.
  void clear() {
    corners.clear();
    corners.reserve(kept.capacity());
    kept.reserve(corners.capacity());
  }

  /// Cuts the polygon to the points at which the distance `outside` is at most `tolerance`.
  template <class Outside>
  void cut(double tolerance, Outside outside) {
    distances.clear();
    bool any_outside = false;
    for (const Vector3& corner : corners) {
      distances.push_back(outside(corner));
      any_outside = any_outside || distances.back() > tolerance;
    }
    if (!any_outside) return;
    kept.clear();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::size_t next = i + 1 < corners.size() ? i + 1 : 0;
      const bool is_in = distances[i] <= tolerance;
      if (is_in) kept.push_back(corners[i]);
      if (is_in == (distances[next] <= tolerance)) continue;
      const double fraction = std::clamp(distances[i] / (distances[i] - distances[next]), 0.0, 1.0);
      kept.push_back(corners[i] + fraction * (corners[next] - corners[i]));
    }
    corners.swap(kept);
  }
};

/// Writes the corners of the hull of points in a plane to `hull`, counter-clockwise from the first, by
/// Andrew's chains. Points, which have members x and y, ascend by x, then by y; `hull` has room for twice
/// their number. Leaves out points no farther than `tolerance` outside the line through their neighbours.
/// Returns the number of corners.
template <class Point>
std::size_t planar_hull(std::span<const Point> points, double tolerance, Point* hull) {
  std::size_t size = 0;
  const auto add = [&](const Point& point, std::size_t least) {
    // Remove corners that are not to the right of the way from the corner before them to this point.
    while (size >= least) {
      const Point& from = hull[size - 2];
      const Point& over = hull[size - 1];
      const double along_x = point.x - from.x;
      const double along_y = point.y - from.y;
      if ((over.x - from.x) * along_y - (over.y - from.y) * along_x >
          tolerance * std::sqrt(along_x * along_x + along_y * along_y)) {
        break;
      }
      --size;
    }
    hull[size++] = point;
  };
  for (const Point& point : points) add(point, 2);
  const std::size_t lower = size + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  return size - 1;  // without the first point, which is added twice
}

/// A face and the separation of another shape from it, m. Of a box `face` is the axis, 0 to 2.
struct FaceAxis {
  double separation = -infinity;
  std::uint32_t face = 0;
};

inline Segment edge_of(const Polytope& polytope, std::uint32_t edge) {
  return {polytope.vertices[polytope.edges[edge][0]], polytope.vertices[polytope.edges[edge][1]]};
}

/// Calls `use(corner, outward)` for each side of a face: a point of it and its unnormalised outward direction
/// in the face's plane.
template <class Use>
void for_each_side(const Polytope& polytope, std::size_t face, Use use) {
  const std::uint32_t begin = polytope.face_begin[face];
  const std::uint32_t end = polytope.face_begin[face + 1];
  for (std::uint32_t i = begin; i < end; ++i) {
    const Vector3& from = polytope.vertices[polytope.face_vertices[i]];
    const Vector3& to = polytope.vertices[polytope.face_vertices[i + 1 < end ? i + 1 : begin]];
    use(from, (to - from).cross(polytope.face_normals[face]));
  }
}

/// Returns true where the point lies in the infinite prism over and under the face.
bool is_over(const Polytope& polytope, std::size_t face, const Vector3& point);

/// An edge of a convex polytope. It is outermost in the directions between the normals of its two faces.
struct PolytopeEdge {
  Vector3 from;
  Vector3 along;
  std::array<Vector3, 2> normals;
  Vector3 across;  ///< normals[0] × normals[1]
};

/// Sets `axis` to the unit vector across two edges, outward of a. Returns false unless it bounds the overlap
/// of the polytopes: unless the arcs that the normals of a and the negative normals of b span on the unit
/// sphere cross. `b` has the negative normals.
[[gnu::always_inline]] inline bool cross_edges(const PolytopeEdge& a, const PolytopeEdge& b, Vector3& axis) {
  const double b0 = b.normals[0].dot(a.across);
  const double b1 = b.normals[1].dot(a.across);
  if (b0 * b1 >= 0) return false;
  const double a0 = a.normals[0].dot(b.across);
  const double a1 = a.normals[1].dot(b.across);
  if (a0 * a1 >= 0 || b0 * a1 <= 0) return false;
  axis = a.along.cross(b.along);
  const double squared = axis.squaredNorm();
  if (squared <= 1e-12 * a.along.squaredNorm() * b.along.squaredNorm()) return false;
  axis /= std::sqrt(squared);
  if (axis.dot(a.normals[0] + a.normals[1]) < 0) axis = -axis;
  return true;
}

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
  /// For each side, whether the surface continues in the same plane behind it; empty where it nowhere does.
  std::span<const bool> continues;

  Segment side(std::size_t i) const { return {corners[i], corners[i + 1 < corners.size() ? i + 1 : 0]}; }
};

/// The feature of a revolved solid that faces a direction: one of its discs, or the line along its side, from
/// bottom to top, of points farthest along the direction.
using RevolvedFeature = std::variant<Disc, Segment>;

Disc end_disc(const RevolvedSolid& solid, int end);

RevolvedFeature feature_towards(const RevolvedSolid& solid, const Vector3& direction);

/// Returns 8 points of the rim at equal angles. One of them is the deepest below a plane with this normal or,
/// where the disc is parallel to the plane to 1e-5, lies at the disc's own `across`.
std::array<Vector3, 8> rim_points(const Disc& disc, const Vector3& plane_normal);

/// Returns the line of points of a solid's side farthest along `direction` where its ends are equally far to
/// within `near`; else the farthest point, twice.
Segment line_or_point(const RevolvedSolid& solid, const Vector3& direction, double near);

/// Collects the contacts of features of a and b along `normal` (unit, from b to a) below the margin.
class Manifold {
 public:
  /// `size`: of the smaller shape, for tolerances.
  Manifold(const Vector3& normal, double size, double margin, Contacts& out)
      : normal_(normal), size_(size), margin_(margin), out_(out), first_(out.size()) {}

  /// Adds points of the disc's rim, corners of the polygon over the disc, and crossings of the two outlines.
  void add(const Disc& a, const Polygon& b);
  /// Adds points of both rims that lie over the other disc, and crossings of the rims.
  void add(const Disc& a, const Disc& b);
  /// Adds two contacts, at the ends of the part of the line that is over the other feature.
  void add(const Disc& a, const Segment& b) { add_disc_segment(a, b, false); }
  void add(const Segment& a, const Disc& b) { add_disc_segment(b, a, true); }
  void add(const Segment& a, const Polygon& b);
  /// Adds the corners of the common part. The plane of the reference polygon is perpendicular to the normal.
  void add(const Polygon& a, const Polygon& b, bool reference_is_b);
  /// Adds the ends of the part along which the segments are beside each other, if they are parallel to within
  /// `preference`; else adds nothing and returns false.
  bool add_beside(const Segment& a, const Segment& b, double preference);
  /// Adds the closest points of segments, which may be points. Adds nothing and returns false where these are
  /// not opposite to each other.
  bool add_crossing(const Segment& a, const Segment& b);
  /// Adds a contact at a point of a and the opposite point of b along the normal.
  void add_point(const Vector3& on_a, double distance);
  /// Removes the manifold's contacts and returns false unless the lowest is at `highest` or below.
  bool keep_if_below(double highest);
  /// Removes overlaps if the shapes are `separation` apart along another axis: their outlines only touch.
  /// Returns false where no contact is left.
  bool drop_overlaps(double separation);

 private:
  void add_disc_segment(const Disc& disc, const Segment& line, bool line_is_a);
  /// Adds the collected pairs of points in their order around the disc; of points within `near` only one.
  void push_round(double near);
  bool is_along_normal(const Vector3& gap, double tolerance) const;
  void push(const Vector3& one, const Vector3& other, bool swapped);

  Vector3 normal_;
  double size_;
  double margin_;
  Contacts& out_;
  std::size_t first_;
};

}  // namespace substep
