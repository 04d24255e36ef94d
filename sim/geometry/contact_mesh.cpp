// Finds contacts of shapes with static triangle meshes: with each near triangle, but for directions in which
// the mesh as a whole does not push; then joins triangles of one plane to one face.

#include <algorithm>
#include <cmath>

#include "sim/geometry/contact_facets.h"
#include "sim/geometry/contact_pairs.h"
#include "sim/geometry/triangle_mesh.h"

namespace substep {
namespace {

/// Largest angle between the normals of contacts of one face, rad.
constexpr double one_direction = 1e-6;

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
};

Scratch& scratch() {
  thread_local Scratch memory;
  return memory;
}

/// The corners of the convex hull of scratch().group, counter-clockwise, into scratch().hull (Andrew's
/// chains). Points no farther than `tolerance` outside a side are on it.
void find_hull(double tolerance) {
  std::vector<Point>& points = scratch().group;
  std::vector<Point>& hull = scratch().hull;
  hull.clear();
  std::ranges::sort(points, [](const Point& p, const Point& q) {
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.contact < q.contact;
  });
  const auto distance = [](const Point& a, const Point& b) {
    return std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
  };
  const auto is_convex = [&](const Point& a, const Point& b, const Point& c) {
    const double side = distance(a, c);
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > tolerance * side;
  };
  const auto add = [&](const Point& point, std::size_t first) {
    while (hull.size() >= first + 2 && !is_convex(hull[hull.size() - 2], hull.back(), point)) hull.pop_back();
    hull.push_back(point);
  };
  for (const Point& point : points) add(point, 0);
  const std::size_t upper = hull.size() - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], upper);
  hull.pop_back();
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

/// Appends of scratch().contacts the corners of the hull of each group with one normal.
void add_hulls(double tolerance, std::vector<ContactPoint>& out) {
  Scratch& memory = scratch();
  const std::vector<ContactPoint>& contacts = memory.contacts;
  memory.taken.assign(contacts.size(), false);
  for (std::size_t first = 0; first < contacts.size(); ++first) {
    if (memory.taken[first]) continue;
    const Vector3& n = contacts[first].normal;
    const Vector3 x = n.unitOrthogonal();
    const Vector3 y = n.cross(x);
    memory.group.clear();
    for (std::size_t i = first; i < contacts.size(); ++i) {
      if (memory.taken[i] || (contacts[i].normal - n).norm() > one_direction) continue;
      // Faces with one direction at different heights are different faces.
      if (std::abs(n.dot(contacts[i].on_b - contacts[first].on_b)) > tolerance) continue;
      memory.taken[i] = true;
      memory.group.push_back(
          {x.dot(contacts[i].on_b), y.dot(contacts[i].on_b), static_cast<std::uint32_t>(i)});
    }
    if (memory.group.size() > 1) {
      find_hull(tolerance);
      for (const Point& point : memory.hull) out.push_back(contacts[point.contact]);
    } else {
      out.push_back(contacts[first]);
    }
  }
}

Vector3 middle_of(const Shape& shape) {
  const auto* polytope = std::get_if<Polytope>(&shape);
  return polytope ? polytope->centre : Vector3::Zero();
}

}  // namespace

void find_shape_mesh(const Shape& a, const Pose& pose_a, const TriangleMesh& b, const Pose& pose_b,
                     double margin, std::vector<ContactPoint>& out) {
  Scratch& memory = scratch();
  const Quaternion back = pose_b.orientation.conjugate();
  const Pose in_mesh = {back * (pose_a.position - pose_b.position), back * pose_a.orientation};
  Bounds box = bounds(a, in_mesh);
  box.lower.array() -= margin;
  box.upper.array() += margin;
  memory.triangles.clear();
  find_triangles(b, box, memory.triangles);
  if (memory.triangles.empty()) return;

  // The mesh's axes, about the shape.
  const Vector3 origin = in_mesh.position;
  const Vector3 middle = in_mesh.orientation * middle_of(a);
  const std::optional<RevolvedSolid> solid = as_revolved(a, {Vector3::Zero(), in_mesh.orientation});
  double size = 0;
  if (solid) {
    size = 2 * solid->reach();
  } else {
    const auto& polytope = std::get<Polytope>(a);
    memory.facets_a.load(polytope, in_mesh.orientation.toRotationMatrix(), Vector3::Zero());
    size = 2 * polytope.bounding_radius;
  }
  memory.contacts.clear();
  for (const std::uint32_t t : memory.triangles) {
    const double height = b.normals[t].dot(middle - (b.vertices[b.triangles[t][0]] - origin));
    if (height < 0 && !b.two_sided) continue;
    memory.facets_b.load(b, t, origin, height < 0);
    if (solid) {
      find_revolved_facets(*solid, memory.facets_b, margin, memory.contacts);
    } else {
      find_polytope_triangle(memory.facets_a, memory.facets_b, margin, memory.contacts);
    }
  }
  const std::size_t first = out.size();
  add_hulls(1e-6 * size, out);
  for (std::size_t i = first; i < out.size(); ++i) {
    // The contact's normal and distance are exact; on_b follows from on_a.
    out[i].normal = pose_b.orientation * out[i].normal;
    out[i].on_a = pose_a.position + pose_b.orientation * out[i].on_a;
    out[i].on_b = out[i].on_a - out[i].distance * out[i].normal;
  }
}

}  // namespace substep
