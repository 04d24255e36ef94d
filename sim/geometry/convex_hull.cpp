#include "sim/geometry/convex_hull.h"

#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "sim/error.h"
#include "sim/geometry/welded_points.h"
#include "sim/math/rotation.h"

namespace substep {
namespace {

/// A hull thinner than this part of its size is refused: its inertia and its contact normals would be noise.
constexpr double smallest_thickness = 1e-6;

/// Facets whose vertices lie within this part of the hull's size of one plane are one face: a few times the
/// rounding of the float coordinates that meshes are stored in.
constexpr double coplanar = 4e-7;

/// Metres. Beyond, products of three lengths leave the range in which they are exact to rounding.
constexpr double largest_coordinate = 1e9;

/// Polygons as lists of corners, stored in one array.
class Polygons {
 public:
  void add(std::span<const std::uint32_t> corners) {
    corners_.insert(corners_.end(), corners.begin(), corners.end());
    begin_.push_back(static_cast<std::uint32_t>(corners_.size()));
  }
  std::size_t size() const { return begin_.size() - 1; }
  std::span<const std::uint32_t> operator[](std::size_t index) const {
    return {corners_.data() + begin_[index], corners_.data() + begin_[index + 1]};
  }
  const std::vector<std::uint32_t>& begin() const { return begin_; }
  const std::vector<std::uint32_t>& corners() const { return corners_; }

 private:
  std::vector<std::uint32_t> begin_ = {0};
  std::vector<std::uint32_t> corners_;
};

/// Twice the area of a polygon as a vector along its normal (Newell's sum, about the first vertex).
Vector3 area_vector(std::span<const Vector3> points, std::span<const std::uint32_t> polygon) {
  Vector3 sum = Vector3::Zero();
  const Vector3& first = points[polygon[0]];
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    sum += (points[polygon[i]] - first).cross(points[polygon[i + 1]] - first);
  }
  return sum;
}

struct DirectedEdge {
  std::uint32_t from, to, face;
};

/// All sides of all polygons, ordered by their two ends, lesser first; so the two sides of an edge are
/// neighbours.
std::vector<DirectedEdge> sides(const Polygons& polygons, std::size_t points) {
  // Put each side into the bin of its lesser end; a bin holds few.
  std::vector<std::uint32_t> bins(points + 1, 0);
  const auto for_each_side = [&](const auto& use) {
    for (std::uint32_t f = 0; f < polygons.size(); ++f) {
      const std::span<const std::uint32_t> corners = polygons[f];
      for (std::size_t i = 0; i < corners.size(); ++i) {
        use(DirectedEdge{corners[i], corners[i + 1 < corners.size() ? i + 1 : 0], f});
      }
    }
  };
  for_each_side([&](const DirectedEdge& side) { ++bins[std::min(side.from, side.to) + 1]; });
  std::partial_sum(bins.begin(), bins.end(), bins.begin());
  std::vector<DirectedEdge> result(polygons.corners().size());
  std::vector<std::uint32_t> next(bins.begin(), bins.end() - 1);
  for_each_side([&](const DirectedEdge& side) { result[next[std::min(side.from, side.to)]++] = side; });
  for (std::size_t i = 0; i < points; ++i) {
    std::sort(result.begin() + bins[i], result.begin() + bins[i + 1],
              [](const DirectedEdge& a, const DirectedEdge& b) {
                const std::uint32_t end_a = std::max(a.from, a.to);
                const std::uint32_t end_b = std::max(b.from, b.to);
                return end_a != end_b ? end_a < end_b : a.from < b.from;
              });
  }
  return result;
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
  polytope.inner_radius = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f + 1 < polytope.face_begin.size(); ++f) {
    const std::span<const std::uint32_t> corners{polytope.face_vertices.data() + polytope.face_begin[f],
                                                 polytope.face_vertices.data() + polytope.face_begin[f + 1]};
    const Vector3 normal = area_vector(polytope.vertices, corners).normalized();
    // The outermost corner, so that the polytope lies below the face's plane even where the corners of a
    // merged face are not quite in one plane.
    double offset = -std::numeric_limits<double>::infinity();
    for (const std::uint32_t corner : corners) {
      offset = std::max(offset, normal.dot(polytope.vertices[corner]));
    }
    polytope.face_normals.push_back(normal);
    polytope.face_offsets.push_back(offset);
    polytope.inner_radius = std::min(polytope.inner_radius, offset - normal.dot(polytope.centre));
  }
  polytope.inner_radius = std::max(polytope.inner_radius, 0.0);
}

/// Assembles a polytope from its vertices and faces. Returns false when the faces do not close.
bool assemble(std::vector<Vector3> vertices, const Polygons& polygons, Polytope& polytope) {
  polytope.vertices = std::move(vertices);
  polytope.face_begin = polygons.begin();
  polytope.face_vertices = polygons.corners();
  const std::vector<DirectedEdge> both = sides(polygons, polytope.vertices.size());
  if (both.size() % 2 != 0) return false;
  polytope.edges.reserve(both.size() / 2);
  polytope.edge_faces.reserve(both.size() / 2);
  for (std::size_t i = 0; i < both.size(); i += 2) {
    if (both[i].from != both[i + 1].to || both[i].to != both[i + 1].from) return false;
    polytope.edges.push_back({both[i].from, both[i].to});
    polytope.edge_faces.push_back({both[i].face, both[i + 1].face});
  }
  measure(polytope);
  return true;
}

/// One run of qhull: everything it allocates and everything it would print, released at the end.
class Qhull {
 public:
  Qhull(std::vector<double>& coordinates) {
    messages_ = open_memstream(&text_, &size_);
    if (!messages_) throw Error("qhull: there is no memory for its messages");
    qh_zero(&qhull_, messages_);
    // Qt: triangles only, whose corners can be read without calling qhull again. Q5: how far points lie
    // outside of merged facets is not asked, so not measured.
    char command[] = "qhull Qt Q5";
    status_ = qh_new_qhull(&qhull_, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(), False,
                           command, nullptr, messages_);
  }
  ~Qhull() {
    qh_freeqhull(&qhull_, qh_ALL);
    int pieces = 0;
    int bytes = 0;
    qh_memfreeshort(&qhull_, &pieces, &bytes);
    std::fclose(messages_);
    std::free(text_);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  bool succeeded() const { return status_ == 0; }

  /// The facets, counter-clockwise seen from outside, as indices of points.
  Polygons triangles() {
    Polygons result;
    std::vector<std::uint32_t> corners;
    qhT* qh = &qhull_;
    facetT* facet = nullptr;
    FORALLfacets {
      corners.clear();
      vertexT* vertex = nullptr;
      vertexT** vertexp = nullptr;
      FOREACHvertex_(facet->vertices) {
        corners.push_back(static_cast<std::uint32_t>(qh_pointid(qh, vertex->point)));
      }
      if (static_cast<bool>(facet->toporient)) std::ranges::reverse(corners);
      result.add(corners);
    }
    return result;
  }

 private:
  qhT qhull_ = {};
  FILE* messages_ = nullptr;
  char* text_ = nullptr;
  std::size_t size_ = 0;
  int status_ = 0;
};

/// Faces of triangles that lie in one plane to within `tolerance`. qhull merges only what its own rounding
/// cannot tell apart.
class FaceMerger {
 public:
  FaceMerger(std::span<const Vector3> points, const Polygons& triangles, double tolerance)
      : points_(points),
        triangles_(triangles),
        tolerance_(tolerance),
        sides_(sides(triangles, points.size())),
        group_(triangles.size(), none) {}

  /// Returns the faces, or nothing when an outline is no polygon.
  Polygons faces() {
    group();
    // What remains of a group's sides is its outline.
    std::vector<std::uint32_t> begin(triangles_.size() + 1, 0);
    const auto for_each_outer_side = [&](const auto& use) {
      for (std::size_t i = 0; i + 1 < sides_.size(); i += 2) {
        if (group_[sides_[i].face] == group_[sides_[i + 1].face]) continue;
        use(sides_[i]);
        use(sides_[i + 1]);
      }
    };
    for_each_outer_side([&](const DirectedEdge& side) { ++begin[group_[side.face] + 1]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<Side> outer(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for_each_outer_side([&](const DirectedEdge& side) {
      outer[next[group_[side.face]]++] = {side.from, side.to};
    });
    Polygons result;
    for (const std::uint32_t seed : seeds_) {
      const std::span<Side> outline(outer.data() + begin[seed], outer.data() + begin[seed + 1]);
      if (!follow(outline)) return {};
      result.add(polygon_);
    }
    return result;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  using Side = std::array<std::uint32_t, 2>;

  // Gives each triangle the number of the one that its face began with.
  void group() {
    std::vector<std::array<std::uint32_t, 3>> neighbours(triangles_.size(), {none, none, none});
    const auto join = [&](std::uint32_t one, std::uint32_t other) {
      const auto free = std::ranges::find(neighbours[one], none);
      if (free != neighbours[one].end()) *free = other;
    };
    for (std::size_t i = 0; i + 1 < sides_.size(); i += 2) {
      join(sides_[i].face, sides_[i + 1].face);
      join(sides_[i + 1].face, sides_[i].face);
    }
    // The largest triangle of a face has the most exact plane: start from it.
    std::vector<Vector3> areas(triangles_.size());
    std::vector<std::pair<double, std::uint32_t>> order;
    order.reserve(triangles_.size());
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      areas[i] = area_vector(points_, triangles_[i]);
      order.emplace_back(-areas[i].norm(), i);
    }
    std::ranges::sort(order);
    std::vector<std::uint32_t> front;
    for (const auto& [negative_area, seed] : order) {
      if (group_[seed] != none) continue;
      const Vector3 normal = areas[seed].normalized();
      const double offset = normal.dot(points_[triangles_[seed][0]]);
      const auto belongs = [&](std::uint32_t candidate) {
        return std::ranges::all_of(triangles_[candidate], [&](std::uint32_t corner) {
          return std::abs(normal.dot(points_[corner]) - offset) <= tolerance_;
        });
      };
      group_[seed] = seed;
      seeds_.push_back(seed);
      front.assign(1, seed);
      while (!front.empty()) {
        const std::uint32_t current = front.back();
        front.pop_back();
        for (const std::uint32_t other : neighbours[current]) {
          if (other == none || group_[other] != none || !belongs(other)) continue;
          group_[other] = seed;
          front.push_back(other);
        }
      }
    }
  }

  // Sets polygon_ to the outline from corner to corner, from the least on.
  bool follow(std::span<Side> outline) {
    std::ranges::sort(outline);
    polygon_.clear();
    if (outline.empty()) return false;
    std::uint32_t corner = outline[0][0];
    do {
      const auto side =
          std::ranges::lower_bound(outline, corner, {}, [](const Side& pair) { return pair[0]; });
      if (side == outline.end() || (*side)[0] != corner) return false;
      polygon_.push_back(corner);
      corner = (*side)[1];
    } while (corner != outline[0][0] && polygon_.size() <= outline.size());
    return polygon_.size() == outline.size();
  }

  std::span<const Vector3> points_;
  const Polygons& triangles_;
  double tolerance_;
  std::vector<DirectedEdge> sides_;
  std::vector<std::uint32_t> group_;
  std::vector<std::uint32_t> seeds_;  // largest first
  std::vector<std::uint32_t> polygon_;
};

/// Leaves out corners between two faces only, which lie on a straight edge, and vertices that no face has.
Polygons without_unused(std::span<const Vector3> points, const Polygons& polygons,
                        std::vector<Vector3>& vertices) {
  std::vector<std::uint32_t> faces_at(points.size(), 0);
  for (const std::uint32_t corner : polygons.corners()) ++faces_at[corner];
  std::vector<std::uint32_t> index(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (faces_at[i] < 3) continue;
    index[i] = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(points[i]);
  }
  Polygons result;
  std::vector<std::uint32_t> kept;
  for (std::size_t f = 0; f < polygons.size(); ++f) {
    kept.clear();
    for (const std::uint32_t corner : polygons[f]) {
      if (faces_at[corner] >= 3) kept.push_back(index[corner]);
    }
    result.add(kept);
  }
  return result;
}

bool is_thin(const Polytope& polytope, double thickness) {
  // One vertex deep enough below a face is enough, and the last one found mostly serves the next face too.
  Vector3 opposite = polytope.vertices[0];
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    const auto is_deep = [&](const Vector3& vertex) {
      return polytope.face_offsets[f] - polytope.face_normals[f].dot(vertex) > thickness;
    };
    if (is_deep(opposite)) continue;
    const auto found = std::ranges::find_if(polytope.vertices, is_deep);
    if (found == polytope.vertices.end()) return true;
    opposite = *found;
  }
  return false;
}

}  // namespace

Polytope convex_hull(std::span<const Vector3> given, const std::string& what) {
  const auto number = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return std::string(text);
  };
  for (std::size_t i = 0; i < given.size(); ++i) {
    for (const double coordinate : {given[i].x(), given[i].y(), given[i].z()}) {
      // Written so that NaN fails too.
      if (std::abs(coordinate) <= largest_coordinate) continue;
      throw Error(what + ": vertex " + std::to_string(i) + " has the coordinate " + number(coordinate) +
                  "; a convex hull needs finite coordinates within ±1e9 m");
    }
  }
  if (given.size() < 4) {
    throw Error(what + ": a convex hull needs at least 4 vertices, there are " +
                std::to_string(given.size()));
  }
  if (given.size() > static_cast<std::size_t>(std::numeric_limits<int>::max() / 3)) {
    throw Error(what + ": there are too many vertices for a convex hull: " + std::to_string(given.size()));
  }
  // Meshes have a vertex several times where its normals differ.
  const std::vector<Vector3> points = distinct(given);
  Vector3 lower = points[0];
  Vector3 upper = points[0];
  for (const Vector3& point : points) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  const double size = (upper - lower).norm();
  const Error thin(what + ": its convex hull is thinner than 1e-6 of its size of " + number(size) +
                   " m; a solid body needs a mesh with thickness");
  if (size <= 0) throw thin;

  // Scale the points to size one about the origin: qhull's tolerances are made for that.
  const Vector3 middle = lower + (upper - lower) / 2;
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vector3& point : points) {
    const Vector3 local = (point - middle) / size;
    coordinates.insert(coordinates.end(), {local.x(), local.y(), local.z()});
  }
  Polygons triangles;
  {
    Qhull qhull(coordinates);
    if (!qhull.succeeded()) throw thin;
    triangles = qhull.triangles();
  }
  Polytope hull;
  std::vector<Vector3> vertices;
  const Polygons polygons =
      without_unused(points, FaceMerger(points, triangles, coplanar * size).faces(), vertices);
  bool solid = vertices.size() >= 4;
  for (std::size_t f = 0; f < polygons.size(); ++f) solid = solid && polygons[f].size() >= 3;
  if (!solid || !assemble(std::move(vertices), polygons, hull) || is_thin(hull, smallest_thickness * size)) {
    throw thin;
  }
  return hull;
}

Polytope box(const Vector3& size) {
  if (!(size.minCoeff() > 0) || !size.allFinite()) throw Error("a box needs three positive extents");
  const Vector3 half = size / 2;
  std::vector<Vector3> vertices;
  vertices.reserve(8);
  for (int corner = 0; corner < 8; ++corner) {
    vertices.emplace_back((corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                          (corner & 4) != 0 ? half.z() : -half.z());
  }
  Polygons faces;
  for (const std::array<std::uint32_t, 4>& corners : {std::array<std::uint32_t, 4>{1, 3, 7, 5},
                                                      {0, 4, 6, 2},
                                                      {2, 6, 7, 3},
                                                      {0, 1, 5, 4},
                                                      {4, 5, 7, 6},
                                                      {0, 2, 3, 1}}) {
    faces.add(corners);
  }
  Polytope result;
  assemble(std::move(vertices), faces, result);
  result.box = OrientedBox{Pose{}, half};
  return result;
}

Polytope cylinder(double height, double radius_bottom, double radius_top, int sides) {
  if (!(height > 0) || !(radius_bottom >= 0) || !(radius_top >= 0) || !(radius_bottom + radius_top > 0) ||
      !std::isfinite(height + radius_bottom + radius_top) || sides < 3) {
    throw Error("a cylinder needs a positive height, radii that are not both 0, and 3 sides");
  }
  const auto count = static_cast<std::uint32_t>(sides);
  std::vector<Vector3> vertices;
  // Adds the vertices of the ring at y and returns their indices; a ring of radius 0 is one vertex.
  const auto ring = [&](double radius, double y) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    std::vector<std::uint32_t> indices(count, first);
    if (radius == 0) {
      vertices.emplace_back(0, y, 0);
      return indices;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
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
  if (radius_bottom > 0) polygons.add(bottom);
  if (radius_top > 0) polygons.add(std::vector<std::uint32_t>(top.rbegin(), top.rend()));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    if (radius_bottom == 0) {
      polygons.add(std::array{bottom[0], top[i], top[next]});
    } else if (radius_top == 0) {
      polygons.add(std::array{bottom[i], top[0], bottom[next]});
    } else {
      polygons.add(std::array{bottom[i], top[i], top[next], bottom[next]});
    }
  }
  Polytope result;
  assemble(std::move(vertices), polygons, result);
  return result;
}

Polytope ellipsoid(const Vector3& half_axes, int rings) {
  if (!(half_axes.minCoeff() > 0) || !half_axes.allFinite() || rings < 2 || rings % 2 != 0) {
    throw Error("an ellipsoid needs three positive half axes and an even number of rings");
  }
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
  if (result.box) {
    // A turned box scaled along other axes than its own is sheared.
    if (result.box->pose.orientation.vec().isZero(0)) {
      result.box->pose.position = result.box->pose.position.cwiseProduct(factors);
      result.box->half_size = result.box->half_size.cwiseProduct(factors);
    } else {
      result.box.reset();
    }
  }
  if (result.ellipsoid) result.ellipsoid = result.ellipsoid->cwiseProduct(factors);
  return result;
}

Polytope transformed(const Polytope& polytope, const Pose& pose) {
  Polytope result = polytope;
  for (Vector3& vertex : result.vertices) vertex = pose * vertex;
  measure(result);
  if (result.box) result.box->pose = pose * result.box->pose;
  result.ellipsoid.reset();
  return result;
}

}  // namespace substep
