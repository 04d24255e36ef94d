// Contacts of spheres and capsules, and of planes.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "sim/geometry/contact_pairs.h"
#include "sim/geometry/features.h"

namespace substep {
namespace {

/// Fraction of the shape's size within which two points give no direction.
constexpr double coincident = 1e-9;

/// Adds the contact of balls of two radii around two points; `fallback` is the normal where the points
/// coincide.
void add_ball_contact(const Vector3& point_a, double radius_a, const Vector3& point_b, double radius_b,
                      const Vector3& fallback, double margin, Contacts& out) {
  const Vector3 between = point_a - point_b;
  const double distance = between.norm();
  if (distance - radius_a - radius_b >= margin) return;
  const bool has_direction = distance > coincident * (radius_a + radius_b);
  const Vector3 normal = has_direction ? Vector3(between / distance) : fallback;
  const double along = has_direction ? distance : between.dot(normal);
  out.push_back(
      {point_a - radius_a * normal, point_b + radius_b * normal, normal, along - radius_a - radius_b});
}

/// Adds the contacts of two segments with radii: of the closest points or, where the segments are nearly
/// parallel, of the ends of the part along which they lie beside each other.
void add_segment_contacts(const Segment& a, double radius_a, const Segment& b, double radius_b, double size,
                          const Vector3& fallback, double margin, Contacts& out) {
  const SegmentParameters closest = closest_parameters(a, b);
  const Vector3 on_a = point_at(a, closest.on_a);
  const Vector3 on_b = point_at(b, closest.on_b);
  const double distance = (on_a - on_b).norm();

  const double length = (a.to - a.from).norm();
  const double first = closest_parameter(a, b.from);
  const double last = closest_parameter(a, b.to);
  const double low = std::min(first, last);
  const double high = std::max(first, last);
  const double preference = face_preference(distance - radius_a - radius_b, size);
  if ((high - low) * length > preference) {
    const std::array ends = {point_at(a, low), point_at(a, high)};
    const std::array others = {point_at(b, closest_parameter(b, ends[0])),
                               point_at(b, closest_parameter(b, ends[1]))};
    if (std::max((ends[0] - others[0]).norm(), (ends[1] - others[1]).norm()) - distance <= preference) {
      const std::size_t before = out.size();
      for (std::size_t i = 0; i < 2; ++i) {
        add_ball_contact(ends[i], radius_a, others[i], radius_b, fallback, margin, out);
      }
      if (out.size() > before) return;
    }
  }
  add_ball_contact(on_a, radius_a, on_b, radius_b, fallback, margin, out);
}

Segment axis_of(const Capsule& capsule, const Pose& pose) {
  if (capsule.half_length == 0) return {pose.position, pose.position};
  const Vector3 half = pose.orientation * Vector3(0, capsule.half_length, 0);
  return {pose.position - half, pose.position + half};
}

FaceAxis largest_separation(const Polytope& polytope, const Segment& segment) {
  FaceAxis best;
  for (std::uint32_t f = 0; f < polytope.face_count(); ++f) {
    const Vector3& normal = polytope.face_normals[f];
    const double separation =
        std::min(normal.dot(segment.from), normal.dot(segment.to)) - polytope.face_offsets[f];
    if (separation > best.separation) best = {separation, f};
  }
  return best;
}

/// The closest points of a segment (which may be a point) and a polytope that it does not touch.
struct ClosestOfPolytope : ClosestPair {
  std::optional<std::uint32_t> edge;  ///< the edge on which `on_b` lies, if it is not inside a face
};

ClosestOfPolytope closest_points(const Segment& segment, const Polytope& polytope) {
  ClosestOfPolytope best;
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    for (const Vector3& end : {segment.from, segment.to}) {
      const double height = polytope.face_normals[f].dot(end) - polytope.face_offsets[f];
      if (height < 0 || height * height >= best.squared_distance || !is_over(polytope, f, end)) continue;
      best.consider(end, end - height * polytope.face_normals[f]);
    }
  }
  for (std::uint32_t e = 0; e < polytope.edges.size(); ++e) {
    if (best.consider(segment, edge_of(polytope, e))) best.edge = e;
  }
  return best;
}

/// Returns true where part of the segment lies in the polytope.
bool enters(const Polytope& polytope, const Segment& segment) {
  double low = 0;
  double high = 1;
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    const double from = polytope.face_normals[f].dot(segment.from) - polytope.face_offsets[f];
    const double to = polytope.face_normals[f].dot(segment.to) - polytope.face_offsets[f];
    if (!cut_interval(from, to, 0, low, high)) return false;
  }
  return true;
}

/// A segment with a radius against a polytope, in the polytope's frame.
class SegmentAgainstPolytope {
 public:
  SegmentAgainstPolytope(const Segment& segment, double radius, const Polytope& polytope, double margin,
                         Contacts& out)
      : segment_(segment), radius_(radius), polytope_(polytope), margin_(margin), out_(out) {}

  void find() {
    const FaceAxis face = largest_separation(polytope_, segment_);
    if (face.separation - radius_ >= margin_) return;
    // Treat a touched surface as crossed: points so close give no direction, and the face has the normal.
    if (face.separation <= coincident * size_ && enters(polytope_, segment_)) {
      find_deep(face);
    } else {
      find_outside(face);
    }
  }

 private:
  void add(const Vector3& on_segment, const Vector3& normal, double distance) {
    out_.push_back(
        {on_segment - radius_ * normal, on_segment - distance * normal, normal, distance - radius_});
  }

  /// Adds the ends, as far as they are near, of the segment's part over the face. Adds none and returns false
  /// unless one of them is at most `highest` above the face.
  bool add_over(std::size_t face, double highest) {
    double low = 0;
    double high = 1;
    bool any = true;
    for_each_side(polytope_, face, [&](const Vector3& corner, const Vector3& outward) {
      any = any && cut_interval(outward.dot(segment_.from - corner), outward.dot(segment_.to - corner), 0,
                                low, high);
    });
    if (!any) return false;
    const Vector3& normal = polytope_.face_normals[face];
    const std::array points = {point_at(segment_, low), point_at(segment_, high)};
    const std::array heights = {normal.dot(points[0]) - polytope_.face_offsets[face],
                                normal.dot(points[1]) - polytope_.face_offsets[face]};
    const double lowest = std::min(heights[0], heights[1]);
    if (lowest > highest || lowest - radius_ >= margin_) return false;
    const bool is_point = (points[1] - points[0]).norm() <= coincident * size_;
    for (std::size_t i = 0; i < (is_point ? 1U : 2U); ++i) {
      if (heights[i] - radius_ < margin_) add(points[i], normal, heights[i]);
    }
    return true;
  }

  void find_outside(const FaceAxis& face) {
    const ClosestOfPolytope closest = closest_points(segment_, polytope_);
    const double distance = std::sqrt(closest.squared_distance);
    if (distance - radius_ >= margin_) return;
    // Prefer a face that the axis is nearly parallel to, if the axis lies over the face where it is lowest.
    const double preference = face_preference(distance - radius_, size_);
    if (face.separation >= distance - preference && add_over(face.face, distance + preference)) return;
    const Vector3& fallback = polytope_.face_normals[face.face];
    if (closest.edge) {
      add_segment_contacts(segment_, radius_, edge_of(polytope_, *closest.edge), 0, size_, fallback, margin_,
                           out_);
    } else {
      add_ball_contact(closest.on_a, radius_, closest.on_b, 0, fallback, margin_, out_);
    }
  }

  /// Adds contacts of a segment of which a part lies in the polytope, along the axis of least penetration.
  void find_deep(const FaceAxis& face) {
    const Vector3 along = segment_.to - segment_.from;
    double best = -infinity;
    Vector3 best_axis = Vector3::Zero();
    std::uint32_t best_edge = 0;
    for (std::uint32_t e = 0; e < polytope_.edges.size(); ++e) {
      const Segment edge = edge_of(polytope_, e);
      const Vector3 direction = edge.to - edge.from;
      Vector3 axis = along.cross(direction);
      if (axis.squaredNorm() <= 1e-12 * along.squaredNorm() * direction.squaredNorm()) continue;
      axis.normalize();
      if (axis.dot(edge.from - polytope_.centre) < 0) axis = -axis;
      const double separation = axis.dot(segment_.from - edge.from);
      if (separation <= best) continue;
      // Only an edge that is outermost along the axis bounds the polytope there.
      const bool outermost = std::ranges::all_of(polytope_.vertices, [&](const Vector3& vertex) {
        return axis.dot(vertex - edge.from) <= coincident * size_;
      });
      if (!outermost) continue;
      best = separation;
      best_axis = axis;
      best_edge = e;
    }
    const double preference = face_preference(face.separation - radius_, size_);
    if (best <= face.separation + preference && add_over(face.face, face.separation + preference)) return;
    if (best > -infinity) {
      const double on_segment = closest_parameters(segment_, edge_of(polytope_, best_edge)).on_a;
      add(point_at(segment_, on_segment), best_axis, best);
      return;
    }
    const Vector3& normal = polytope_.face_normals[face.face];
    add(normal.dot(along) > 0 ? segment_.from : segment_.to, normal, face.separation);
  }

  Segment segment_;
  double radius_;
  const Polytope& polytope_;
  double size_ = 2 * std::min(radius_ + (segment_.to - segment_.from).norm() / 2, polytope_.bounding_radius);
  double margin_;
  Contacts& out_;
};

}  // namespace

void find_capsule_plane(const Capsule& a, const Pose& pose_a, const Pose& plane, double margin,
                        Contacts& out) {
  const Vector3 normal = plane.orientation * Vector3::UnitY();
  const Segment axis = axis_of(a, pose_a);
  for (const Vector3& end : {axis.from, axis.to}) {
    const double height = normal.dot(end - plane.position);
    if (height - a.radius >= margin) continue;
    out.push_back({end - a.radius * normal, end - height * normal, normal, height - a.radius});
    if (a.half_length == 0) return;
  }
}

void find_capsule_capsule(const Capsule& a, const Pose& pose_a, const Capsule& b, const Pose& pose_b,
                          double margin, Contacts& out) {
  const double reach = a.half_length + a.radius + b.half_length + b.radius + margin;
  if ((pose_a.position - pose_b.position).squaredNorm() >= reach * reach) return;
  const Segment axis_a = axis_of(a, pose_a);
  const Segment axis_b = axis_of(b, pose_b);
  const Vector3 along_a = axis_a.to - axis_a.from;
  const Vector3 along_b = axis_b.to - axis_b.from;
  // Where the axes meet, take their common perpendicular for the normal.
  Vector3 fallback = along_a.cross(along_b);
  if (fallback.norm() > coincident * along_a.norm() * along_b.norm()) {
    fallback.normalize();
  } else {
    const Vector3& longer = along_a.squaredNorm() >= along_b.squaredNorm() ? along_a : along_b;
    fallback = longer.isZero(0) ? Vector3(Vector3::UnitY()) : perpendicular(longer);
  }
  const double size = 2 * std::min(a.half_length + a.radius, b.half_length + b.radius);
  add_segment_contacts(axis_a, a.radius, axis_b, b.radius, size, fallback, margin, out);
}

void find_capsule_polytope(const Capsule& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           double margin, Contacts& out) {
  const Segment axis = axis_of(a, pose_a);
  const Vector3 middle = (axis.from + axis.to) / 2;
  const double reach = (axis.to - axis.from).norm() / 2 + a.radius + b.bounding_radius + margin;
  if ((middle - pose_b.position - pose_b.orientation * b.centre).squaredNorm() >= reach * reach) return;
  const auto in_b = [&](const Vector3& point) -> Vector3 {
    // Subtract first: the difference is exact where both are far from the origin and near each other.
    return pose_b.orientation.conjugate() * (point - pose_b.position);
  };
  const std::size_t first = out.size();
  SegmentAgainstPolytope({in_b(axis.from), in_b(axis.to)}, a.radius, b, margin, out).find();
  place(pose_b, first, out);
}

void find_plane_polytope(const Pose& plane, const Polytope& b, const Pose& pose_b, double margin,
                         Contacts& out) {
  const Vector3 normal = plane.orientation * Vector3::UnitY();
  const Vector3 local = pose_b.orientation.conjugate() * normal;
  const double offset = normal.dot(pose_b.position - plane.position);
  if (offset + local.dot(b.centre) - b.bounding_radius >= margin) return;
  if (b.ellipsoid) {
    const Vector3 reach = b.ellipsoid->cwiseProduct(local);
    const double height = offset - reach.norm();
    if (height >= margin) return;
    const Vector3 point = pose_b * Vector3(-b.ellipsoid->cwiseProduct(reach) / reach.norm());
    out.push_back({point - height * normal, point, -normal, height});
    return;
  }
  for (const Vector3& vertex : b.vertices) {
    const double height = offset + local.dot(vertex);
    if (height >= margin) continue;
    const Vector3 point = pose_b * vertex;
    out.push_back({point - height * normal, point, -normal, height});
  }
}

}  // namespace substep
