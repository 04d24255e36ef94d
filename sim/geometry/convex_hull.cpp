#include "sim/geometry/convex_hull.h"

#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "sim/error.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

using Polygons = std::vector<std::vector<std::uint32_t>>;

/// Hulls thinner than this fraction of their size are refused: inertia and contact normals would be noise.
constexpr double smallest_thickness = 1e-6;

/// Fraction of the hull's size within which vertices of one face's facets lie in a plane: a few times the
/// rounding of the float coordinates of meshes.
constexpr double coplanar = 4e-7;

/// Returns twice the area of a polygon as a vector along its normal (Newell's sum, about the first vertex).
Vector3 area_vector(std::span<const Vector3> points, std::span<const std::uint32_t> polygon) {
  Vector3 sum = Vector3::Zero();
  const Vector3& first = points[polygon[0]];
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    sum += (points[polygon[i]] - first).cross(points[polygon[i + 1]] - first);
  }
  return sum;
}

/// Fills normals, offsets and the two balls from vertices and faces.
void measure(Polytope& polytope) {
  polytope.face_normals.clear();
  polytope.face_offsets.clear();
  polytope.centre.setZero();
  for (const Vector3& vertex : polytope.vertices) polytope.centre += vertex;
  polytope.centre /= static_cast<double>(polytope.vertices.size());
  polytope.bounding_radius = 0;
  for (const Vector3& vertex : polytope.vertices) {
    polytope.bounding_radius = std::max(polytope.bounding_radius, (vertex - polytope.centre).norm());
  }
  polytope.inner_radius = infinity;
  for (std::size_t f = 0; f + 1 < polytope.face_begin.size(); ++f) {
    const std::span<const std::uint32_t> corners{polytope.face_vertices.data() + polytope.face_begin[f],
                                                 polytope.face_vertices.data() + polytope.face_begin[f + 1]};
    const Vector3 normal = area_vector(polytope.vertices, corners).normalized();
    // Take the outermost corner, so that the polytope lies below the face's plane even if the corners of a
    // merged face are not quite in one plane.
    double offset = -infinity;
    for (const std::uint32_t corner : corners) {
      offset = std::max(offset, normal.dot(polytope.vertices[corner]));
    }
    polytope.face_normals.push_back(normal);
    polytope.face_offsets.push_back(offset);
    polytope.inner_radius = std::min(polytope.inner_radius, offset - normal.dot(polytope.centre));
  }
  polytope.inner_radius = std::max(polytope.inner_radius, 0.0);
}

/// Returns the polytope of these vertices and faces; nothing when the faces do not close.
std::optional<Polytope> assembled(std::vector<Vector3> vertices, const Polygons& polygons) {
  const std::vector<FaceSide> sides = sorted_sides(polygons);
  if (!are_paired(sides)) return std::nullopt;
  Polytope polytope;
  polytope.vertices = std::move(vertices);
  polytope.face_begin.push_back(0);
  for (const std::vector<std::uint32_t>& corners : polygons) {
    polytope.face_vertices.insert(polytope.face_vertices.end(), corners.begin(), corners.end());
    polytope.face_begin.push_back(static_cast<std::uint32_t>(polytope.face_vertices.size()));
  }
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    polytope.edges.push_back({sides[i].from, sides[i].to});
    polytope.edge_faces.push_back({sides[i].face, sides[i + 1].face});
  }
  measure(polytope);
  return polytope;
}

/// Returns the facets of the hull of points that are given as x, y, z, x, …: counter-clockwise seen from
/// outside, as indices of points. Returns none where qhull finds no hull.
std::vector<Triangle> hull_facets(std::vector<double>& coordinates) {
  std::FILE* const messages = std::fopen("/dev/null", "w");
  if (!messages) throw Error("qhull: cannot open /dev/null for its messages");
  qhT qhull = {};
  qhT* const qh = &qhull;  // the name that qhull's macros use
  qh_zero(qh, messages);
  // Qt: triangles only, whose corners can be read without calling qhull again. Q5: skip the distance of
  // points outside merged facets.
  char command[] = "qhull Qt Q5";
  const int status = qh_new_qhull(qh, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(), False,
                                  command, nullptr, messages);
  std::vector<Triangle> result;
  if (status == 0) {
    result.reserve(static_cast<std::size_t>(qh->num_facets));
    facetT* facet = nullptr;
    FORALLfacets {
      std::size_t count = 0;
      Triangle& corners = result.emplace_back();
      vertexT* vertex = nullptr;
      vertexT** vertexp = nullptr;
      FOREACHvertex_(facet->vertices) {
        corners.at(count++) = static_cast<std::uint32_t>(qh_pointid(qh, vertex->point));
      }
      if (static_cast<bool>(facet->toporient)) std::ranges::reverse(corners);
    }
  }
  qh_freeqhull(qh, qh_ALL);
  int pieces = 0;
  int bytes = 0;
  qh_memfreeshort(qh, &pieces, &bytes);
  std::fclose(messages);
  return result;
}

/// Joins triangles that lie in one plane to within `tolerance` to faces. qhull itself merges only triangles
/// that rounding makes indistinguishable.
class FaceMerger {
 public:
  FaceMerger(std::span<const Vector3> points, std::span<const Triangle> triangles, double tolerance)
      : points_(points), triangles_(triangles), tolerance_(tolerance) {}

  /// Returns the faces, or nothing when an outline is no polygon.
  Polygons faces() {
    group();
    // A group's outline has the sides that are between two groups.
    std::vector<std::vector<OuterSide>> outlines(triangles_.size());
    for (std::size_t i = 0; i + 1 < sides_.size(); i += 2) {
      if (group_[sides_[i].face] == group_[sides_[i + 1].face]) continue;
      for (const FaceSide& side : {sides_[i], sides_[i + 1]})
        outlines[group_[side.face]].push_back({side.from, side.to});
    }
    Polygons result;
    for (const std::uint32_t seed : seeds_) {
      result.push_back(polygon_of(outlines[seed]));
      if (result.back().empty()) return {};
    }
    return result;
  }

 private:
  struct OuterSide {
    std::uint32_t from, to;
    auto operator<=>(const OuterSide&) const = default;
  };

  /// Sets group_ of each triangle to the index of its face's largest triangle.
  void group() {
    std::vector<Triangle> neighbours(triangles_.size(), {no_index, no_index, no_index});
    for (std::size_t i = 0; i + 1 < sides_.size(); i += 2) {
      neighbours[sides_[i].face][sides_[i].corner] = sides_[i + 1].face;
      neighbours[sides_[i + 1].face][sides_[i + 1].corner] = sides_[i].face;
    }
    // Begin each face with its largest triangle, which has the most exact plane.
    std::vector<Vector3> areas(triangles_.size());
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      areas[i] = area_vector(points_, triangles_[i]);
      order.emplace_back(-areas[i].norm(), i);
    }
    std::ranges::sort(order);
    for (const auto& [negative_area, seed] : order) {
      if (group_[seed] == no_index) flood(seed, areas[seed].normalized(), neighbours);
    }
  }

  /// Gives the number of a triangle to connected ones that lie in its plane.
  void flood(std::uint32_t seed, const Vector3& normal, std::span<const Triangle> neighbours) {
    const double offset = normal.dot(points_[triangles_[seed][0]]);
    const auto belongs = [&](std::uint32_t candidate) {
      return std::ranges::all_of(triangles_[candidate], [&](std::uint32_t corner) {
        return std::abs(normal.dot(points_[corner]) - offset) <= tolerance_;
      });
    };
    group_[seed] = seed;
    seeds_.push_back(seed);
    std::vector<std::uint32_t> front = {seed};
    while (!front.empty()) {
      const std::uint32_t current = front.back();
      front.pop_back();
      for (const std::uint32_t other : neighbours[current]) {
        if (other == no_index || group_[other] != no_index || !belongs(other)) continue;
        group_[other] = seed;
        front.push_back(other);
      }
    }
  }

  /// Returns the outline from corner to corner, from the least on; nothing when it is no polygon.
  static std::vector<std::uint32_t> polygon_of(std::span<OuterSide> outline) {
    std::ranges::sort(outline);
    std::vector<std::uint32_t> polygon;
    if (outline.empty()) return polygon;
    std::uint32_t corner = outline[0].from;
    do {
      const auto side = std::ranges::lower_bound(outline, corner, {}, &OuterSide::from);
      if (side == outline.end() || side->from != corner) return {};
      polygon.push_back(corner);
      corner = side->to;
    } while (corner != outline[0].from && polygon.size() <= outline.size());
    if (polygon.size() != outline.size()) polygon.clear();
    return polygon;
  }

  std::span<const Vector3> points_;
  std::span<const Triangle> triangles_;
  double tolerance_;
  std::vector<FaceSide> sides_ = sorted_sides(triangles_);
  std::vector<std::uint32_t> group_ = std::vector(triangles_.size(), no_index);
  std::vector<std::uint32_t> seeds_;  ///< largest first
};

/// Removes corners between two faces only, which lie on a straight edge, and vertices that no face has.
void remove_unused(std::vector<Vector3>& points, Polygons& polygons) {
  std::vector<std::uint32_t> faces_at(points.size(), 0);
  for (const auto& corners : polygons) {
    for (const std::uint32_t corner : corners) ++faces_at[corner];
  }
  std::vector<std::uint32_t> index(points.size());
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (faces_at[i] < 3) continue;
    index[i] = kept;
    points[kept++] = points[i];
  }
  points.resize(kept);
  for (auto& corners : polygons) {
    std::erase_if(corners, [&](std::uint32_t corner) { return faces_at[corner] < 3; });
    for (std::uint32_t& corner : corners) corner = index[corner];
  }
}

/// Returns true where a polytope is nowhere deeper than `thickness` below one of its faces.
bool is_thin(const Polytope& polytope, double thickness) {
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    const bool is_deep = std::ranges::any_of(polytope.vertices, [&](const Vector3& vertex) {
      return polytope.face_offsets[f] - polytope.face_normals[f].dot(vertex) > thickness;
    });
    if (!is_deep) return true;
  }
  return false;
}

}  // namespace

Polytope convex_hull(std::span<const Vector3> given, const std::string& what) {
  require_near(given, what, "a convex hull");
  if (given.size() < 4)
    throw Error("{}: a convex hull needs at least 4 vertices, there are {}", what, given.size());
  // Remove duplicates: meshes repeat a vertex whose normals differ.
  std::vector<Vector3> points = distinct(given);
  Bounds extent;
  for (const Vector3& point : points) extent.extend(point);
  const double size = extent.sizes().norm();
  const Error thin(
      "{}: its convex hull is thinner than 1e-6 of its size of {:.6g} m; a solid body "
      "needs a mesh with thickness",
      what, size);
  if (size <= 0) throw thin;

  // Scale the points to size one about the origin, for which qhull's tolerances are made.
  const Vector3 middle = extent.min() + extent.sizes() / 2;
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vector3& point : points) {
    const Vector3 local = (point - middle) / size;
    coordinates.insert(coordinates.end(), {local.x(), local.y(), local.z()});
  }
  const std::vector<Triangle> facets = hull_facets(coordinates);
  if (facets.empty()) throw thin;
  Polygons faces = FaceMerger(points, facets, coplanar * size).faces();
  remove_unused(points, faces);
  if (points.size() < 4 || std::ranges::any_of(faces, [](const auto& face) { return face.size() < 3; }))
    throw thin;
  std::optional<Polytope> hull = assembled(std::move(points), faces);
  if (!hull || is_thin(*hull, smallest_thickness * size)) throw thin;
  return *std::move(hull);
}

Polytope box(const Vector3& size) {
  if (!(size.minCoeff() > 0) || !size.allFinite()) throw Error("a box needs three positive extents");
  const Vector3 half = size / 2;
  std::vector<Vector3> vertices;
  for (int corner = 0; corner < 8; ++corner) {
    vertices.emplace_back((corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                          (corner & 4) != 0 ? half.z() : -half.z());
  }
  const Polygons faces = {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}};
  Polytope result = *assembled(std::move(vertices), faces);
  result.half_box = half;
  return result;
}

Polytope cylinder(double height, double radius_bottom, double radius_top, int sides) {
  make_cylinder(height, radius_bottom, radius_top);  // throws Error for invalid measures
  if (sides < 3) throw Error("a prism needs at least 3 sides, but has {}", sides);
  const auto count = static_cast<std::uint32_t>(sides);
  std::vector<Vector3> vertices;
  // Adds the vertices of the ring at y and returns their indices; a ring of radius 0 is one vertex.
  const auto ring = [&](double radius, double y) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    std::vector<std::uint32_t> indices(count, first);
    for (std::uint32_t i = 0; i < (radius > 0 ? count : 1); ++i) {
      const auto [sine, cosine] = sine_cosine(2 * std::numbers::pi * i / count);
      vertices.emplace_back(radius * cosine, y, radius * sine);
      indices[i] = first + i;
    }
    return indices;
  };
  const std::vector<std::uint32_t> bottom = ring(radius_bottom, -height / 2);
  const std::vector<std::uint32_t> top = ring(radius_top, height / 2);
  Polygons polygons;
  // Angles grow from +X to +Z, clockwise seen from above: the bottom's outline seen from below.
  if (radius_bottom > 0) polygons.push_back(bottom);
  if (radius_top > 0) polygons.emplace_back(top.rbegin(), top.rend());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    std::vector<std::uint32_t>& side = polygons.emplace_back();
    side.push_back(bottom[i]);
    side.push_back(top[i]);
    if (radius_top > 0) side.push_back(top[next]);
    if (radius_bottom > 0) side.push_back(bottom[next]);
  }
  return *assembled(std::move(vertices), polygons);
}

Polytope ellipsoid(const Vector3& half_axes, int rings) {
  if (!(half_axes.minCoeff() > 0) || !half_axes.allFinite() || rings < 2 || rings % 2 != 0)
    throw Error("an ellipsoid needs three positive half axes and an even number of rings");
  const int sectors = 2 * rings;
  std::vector<Vector3> points{Vector3(0, half_axes.y(), 0)};
  for (int ring = 1; ring < rings; ++ring) {
    const auto [out, up] = sine_cosine(std::numbers::pi * ring / rings);
    for (int sector = 0; sector < sectors; ++sector) {
      const auto [sine, cosine] = sine_cosine(2 * std::numbers::pi * sector / sectors);
      points.emplace_back(half_axes.cwiseProduct(Vector3(out * cosine, up, out * sine)));
    }
  }
  points.emplace_back(0, -half_axes.y(), 0);
  Polytope result = convex_hull(points, "an ellipsoid");
  result.ellipsoid = half_axes;
  return result;
}

Polytope scaled(const Polytope& polytope, const Vector3& factors) {
  if (!(factors.minCoeff() > 0) || !factors.allFinite()) throw Error("a shape needs positive scale factors");
  Polytope result = polytope;
  for (Vector3& vertex : result.vertices) vertex = vertex.cwiseProduct(factors);
  measure(result);
  if (result.half_box) result.half_box = result.half_box->cwiseProduct(factors);
  if (result.ellipsoid) result.ellipsoid = result.ellipsoid->cwiseProduct(factors);
  return result;
}

}  // namespace substep
