// Finds contacts of shapes with static triangle meshes: with each near triangle, but for directions in which
// the mesh as a whole does not push; then joins triangles of one plane to one face.

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sim/geometry/contact_facets.h"
#include "sim/geometry/contact_pairs.h"
#include "sim/geometry/triangle_mesh.h"

namespace substep {
namespace {

/// Largest angle between the normals of contacts of one face, rad: vertices in single precision are off by as
/// much. Points of round shapes shift by that fraction of the size.
constexpr double one_direction = 1e-5;

/// A contact in the plane of its group.
struct Point {
  double x;
  double y;
  std::uint32_t contact;
};

struct Scratch {
  std::vector<std::uint32_t> triangles;
  Facets facets_a;
  Facets facets_b;
  std::vector<ContactPoint> contacts;
  std::vector<bool> taken;
  std::vector<Point> group;
  std::vector<Point> hull;
  std::vector<PolytopeEdge> edges_a;
  std::vector<Vector3> corners_a;
  std::vector<Vector3> corners_b;
};

thread_local Scratch scratch;

/// The search for the axis of contact of a polytope a and a triangle b of a mesh, and the contacts along it.
class TriangleSearch {
 public:
  TriangleSearch(const Facets& a, const Facets& b, double margin, Contacts& out)
      : a_(a), b_(b), size_(std::min(a.size, b.size)), margin_(margin), out_(out) {}

  void find() {
    if (!search_faces()) return;
    for (const Vector3& n : b_.around) {
      const double separation = separation_along(n);
      if (separation >= margin_) return;
      if (separation > edge_.separation) edge_ = {{separation, n}, no_index, true};
    }
    for (std::uint32_t i = 0; i < b_.arcs.size(); ++i) {
      if (!search_arc(i)) return;
    }
    const double preference = face_preference(face_.separation, size_);
    const bool edge_first = edge_.separation > face_.separation + preference;
    if (edge_first && edge_.of_neighbour) return;  // the neighbour has the contact
    if (!edge_first && add_face_contacts()) return;
    // Far below the face's, an edge's direction is not the one in which the two meet.
    const bool is_near = edge_.separation > face_.separation - preference;
    if (is_near && edge_.arc != no_index) {
      const Segment of_a = a_.edge(a_.arcs[edge_.arc_a]);
      const Segment of_b = b_.edge(b_.arcs[edge_.arc]);
      Manifold manifold(edge_.normal, size_, margin_, out_);
      const double near = face_preference(edge_.separation, size_);
      if (manifold.add_beside(of_a, of_b, near) || manifold.add_crossing(of_a, of_b)) return;
    }
    if (edge_first && add_face_contacts()) return;
    if (std::max(edge_.separation, face_.separation) > 0) add_closest();
  }

 private:
  double separation_along(const Vector3& n) const { return -a_.extent(-n).height - b_.extent(n).height; }

  /// Finds the face of the largest separation. Returns false where that is the margin or more.
  bool search_faces() {
    const Vector3& front = b_.face_normals[0];
    face_ = {{-a_.extent(-front).height - b_.face_offsets[0], front}, true, 0};
    if (face_.separation >= margin_) return false;
    for (std::uint32_t f = 0; f < a_.face_normals.size(); ++f) {
      const Vector3 n = -a_.face_normals[f];
      const auto [height, vertex] = b_.extent(n);
      const double separation = -a_.face_offsets[f] - height;
      if (separation <= std::max(face_.separation, face_of_a_.separation) || !b_.pushes(n, vertex)) continue;
      if (separation >= margin_) return false;
      face_of_a_ = {{separation, n}, false, f};
    }
    const double preference = second_face_preference(face_.separation, size_);
    if (face_of_a_.separation > face_.separation + preference) face_ = face_of_a_;
    return true;
  }

  /// Searches the cross products of one edge of b with those of a. Returns false where one separates the two
  /// by the margin.
  bool search_arc(std::uint32_t i) {
    const Facets::Arc& arc = b_.arcs[i];
    const auto [from, to] = b_.edge(arc);
    const PolytopeEdge of_b = {from, to - from, {arc.first, arc.last}, arc.first.cross(arc.last)};
    for (std::uint32_t k = 0; k < scratch.edges_a.size(); ++k) {
      Vector3 n;
      if (!cross_edges(of_b, scratch.edges_a[k], n)) continue;
      const double separation = separation_along(n);
      if (separation <= edge_.separation) continue;
      edge_ = {{separation, n}, i, false, k};
      if (separation >= margin_) return false;
    }
    return true;
  }

  bool add_face_contacts() {
    const std::uint32_t face_of_a = face_.of_b ? a_.face_towards(-face_.normal) : face_.face;
    Manifold manifold(face_.normal, size_, margin_, out_);
    manifold.add(a_.polygon(face_of_a, scratch.corners_a), b_.polygon(0, scratch.corners_b), face_.of_b);
    return manifold.drop_overlaps(std::max(edge_.separation, face_of_a_.separation));
  }

  /// Adds the closest points of shapes that are apart, with no face over the other and no edges crossing, if
  /// the mesh pushes there.
  void add_closest() {
    ClosestPair closest = {.squared_distance = margin_ * margin_};
    const Polygon triangle = b_.polygon(0, scratch.corners_b);
    for (const Facets::Arc& arc : a_.arcs) {
      for (std::size_t i = 0; i < 3; ++i) closest.consider(a_.edge(arc), triangle.side(i));
    }
    const double distance = std::sqrt(closest.squared_distance);
    if (closest.squared_distance == margin_ * margin_ || distance <= flush_fraction * size_) return;
    const Vector3 n = (closest.on_a - closest.on_b) / distance;
    // Skip what is not closest, or is closer to a neighbour.
    if (separation_along(n) < distance - 1e-6 * size_ || !b_.pushes(n, b_.extent(n).vertex)) return;
    out_.push_back({closest.on_a, closest.on_b, n, distance});
  }

  const Facets& a_;
  const Facets& b_;
  double size_;
  double margin_;
  Contacts& out_;
  FacetsFaceAxis face_;
  FacetsFaceAxis face_of_a_;
  FacetsEdgeAxis edge_;
};

/// Puts the corners of the convex hull of scratch.group, counter-clockwise, into scratch.hull.
void find_hull(double tolerance) {
  std::vector<Point>& points = scratch.group;
  std::vector<Point>& hull = scratch.hull;
  // Sort by columns of the tolerance's width: rounding would put a line across x into disorder.
  const auto column = [&](const Point& p) { return std::round(p.x / tolerance); };
  std::ranges::sort(points, [&](const Point& p, const Point& q) {
    return std::tuple(column(p), p.y, p.contact) < std::tuple(column(q), q.y, q.contact);
  });
  const auto distance = [](const Point& a, const Point& b) {
    return std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
  };
  hull.resize(2 * points.size());
  hull.resize(planar_hull(std::span<const Point>(points), tolerance, hull.data()));
  // Keep one of several points at one position.
  for (std::size_t i = 1; i < hull.size();) {
    const bool same = distance(hull[i - 1], hull[i]) <= tolerance;
    const bool same_as_first = distance(hull[0], hull[i]) <= tolerance;
    if (same || same_as_first) {
      hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

/// Appends the corners of the hull of each group of scratch.contacts that has one normal.
void add_hulls(double tolerance, Contacts& out) {
  const Contacts& contacts = scratch.contacts;
  scratch.taken.assign(contacts.size(), false);
  for (std::size_t first = 0; first < contacts.size(); ++first) {
    if (scratch.taken[first]) continue;
    const Vector3& n = contacts[first].normal;
    const Vector3 x = n.unitOrthogonal();
    const Vector3 y = n.cross(x);
    scratch.group.clear();
    for (std::size_t i = first; i < contacts.size(); ++i) {
      if (scratch.taken[i] || (contacts[i].normal - n).norm() > one_direction) continue;
      // Faces with one direction at different heights are different faces.
      if (std::abs(n.dot(contacts[i].on_b - contacts[first].on_b)) > tolerance) continue;
      scratch.taken[i] = true;
      scratch.group.push_back(
          {x.dot(contacts[i].on_b), y.dot(contacts[i].on_b), static_cast<std::uint32_t>(i)});
    }
    if (scratch.group.size() > 1) {
      find_hull(tolerance);
      for (const Point& point : scratch.hull) out.push_back(contacts[point.contact]);
    } else {
      out.push_back(contacts[first]);
    }
  }
}

}  // namespace

void find_shape_mesh(const Shape& a, const Pose& pose_a, const TriangleMesh& b, const Pose& pose_b,
                     double margin, Contacts& out) {
  const Quaternion back = pose_b.orientation.conjugate();
  const Pose in_mesh = {back * (pose_a.position - pose_b.position), back * pose_a.orientation};
  Bounds box = bounds(a, in_mesh);
  box.min().array() -= margin;
  box.max().array() += margin;
  scratch.triangles.clear();
  find_triangles(b, box, scratch.triangles);
  if (scratch.triangles.empty()) return;

  // Search in the mesh's axes, about the shape.
  const Vector3 origin = in_mesh.position;
  Vector3 middle = Vector3::Zero();
  const std::optional<RevolvedSolid> solid = as_revolved(a, {Vector3::Zero(), in_mesh.orientation});
  double size = 0;
  if (solid) {
    size = 2 * solid->reach();
  } else {
    const auto& polytope = std::get<Polytope>(a);
    middle = in_mesh.orientation * polytope.centre;
    scratch.facets_a.load(polytope, in_mesh.orientation.toRotationMatrix());
    size = 2 * polytope.bounding_radius;
    scratch.edges_a.clear();
    for (const Facets::Arc& arc : scratch.facets_a.arcs) {
      const auto [from, to] = scratch.facets_a.edge(arc);
      scratch.edges_a.push_back({from, to - from, {-arc.first, -arc.last}, arc.first.cross(arc.last)});
    }
  }
  scratch.contacts.clear();
  for (const std::uint32_t t : scratch.triangles) {
    const double height = b.normals[t].dot(middle - (b.vertices[b.triangles[t][0]] - origin));
    if (height < 0 && !b.two_sided) continue;
    scratch.facets_b.load(b, t, origin, height < 0);
    if (solid) {
      find_revolved_facets(*solid, scratch.facets_b, margin, scratch.contacts);
    } else {
      TriangleSearch(scratch.facets_a, scratch.facets_b, margin, scratch.contacts).find();
    }
  }
  const std::size_t first = out.size();
  add_hulls(one_direction * size, out);
  for (std::size_t i = first; i < out.size(); ++i) {
    // The contact's normal and distance are exact; on_b follows from on_a.
    out[i].normal = pose_b.orientation * out[i].normal;
    out[i].on_a = pose_a.position + pose_b.orientation * out[i].on_a;
    out[i].on_b = out[i].on_a - out[i].distance * out[i].normal;
  }
}

}  // namespace substep
