#include "sim/geometry/triangle_mesh.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

constexpr std::uint32_t leaf_size = 4;

/// Fraction of its longest side below which a triangle's height is too small for an exact normal.
constexpr double smallest_height = 1e-10;

/// Gives each vertex the index of the first at its position, and removes unused vertices.
void weld(TriangleMesh& mesh) {
  const std::vector<Vector3>& given = mesh.vertices;
  const std::vector<std::uint32_t> first = welded(given);
  std::vector<std::uint32_t> index(given.size(), no_index);
  std::vector<Vector3> kept;
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      std::uint32_t& to = index[first[corner]];
      if (to == no_index) {
        to = static_cast<std::uint32_t>(kept.size());
        kept.push_back(given[first[corner]]);
      }
      corner = to;
    }
  }
  mesh.vertices = std::move(kept);
}

Vector3 area_vector(std::span<const Vector3> vertices, const Triangle& triangle) {
  const Vector3& a = vertices[triangle[0]];
  return (vertices[triangle[1]] - a).cross(vertices[triangle[2]] - a);
}

bool has_area(std::span<const Vector3> vertices, const Triangle& triangle) {
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    longest = std::max(longest, (vertices[triangle[(i + 1) % 3]] - vertices[triangle[i]]).squaredNorm());
  }
  return area_vector(vertices, triangle).norm() > smallest_height * longest;
}

Bounds triangle_bounds(const TriangleMesh& mesh, const Triangle& triangle) {
  Bounds box;
  for (const std::uint32_t corner : triangle) box.extend(mesh.vertices[corner]);
  return box;
}

/// Builds the tree of boxes: splits triangles at the median of their middles until leaves are small.
class TreeBuilder {
 public:
  explicit TreeBuilder(TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    boxes_.reserve(order_.size());
    middles_.reserve(order_.size());
    for (const Triangle& triangle : mesh.triangles) {
      boxes_.push_back(triangle_bounds(mesh, triangle));
      middles_.emplace_back(boxes_.back().min() + boxes_.back().max());
    }
  }

  /// Returns the triangles in the order of the leaves, of which each holds neighbours.
  std::vector<std::uint32_t> build() {
    mesh_.nodes.assign(1, {});
    split(0, 0, static_cast<std::uint32_t>(order_.size()));
    return std::move(order_);
  }

 private:
  void split(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    const std::span<std::uint32_t> triangles(order_.data() + begin, order_.data() + end);
    if (triangles.size() <= leaf_size) {
      // Sort the leaf, since std::nth_element leaves its triangles in an order that depends on the library.
      std::ranges::sort(triangles);
      Bounds box;
      for (const std::uint32_t t : triangles) box.extend(boxes_[t]);
      mesh_.nodes[node] = {box, begin, end - begin};
      return;
    }
    Bounds middles;
    for (const std::uint32_t t : triangles) middles.extend(middles_[t]);
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const std::uint32_t half = begin + (end - begin) / 2;
    std::ranges::nth_element(triangles, triangles.begin() + (half - begin), {},
                             [&](std::uint32_t t) { return std::pair(middles_[t][axis], t); });
    const auto first = static_cast<std::uint32_t>(mesh_.nodes.size());
    mesh_.nodes.resize(mesh_.nodes.size() + 2);
    split(first, begin, half);
    split(first + 1, half, end);
    mesh_.nodes[node].first = first;
    mesh_.nodes[node].bounds = mesh_.nodes[first].bounds.merged(mesh_.nodes[first + 1].bounds);
  }

  TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Bounds> boxes_;
  std::vector<Vector3> middles_;  // twice
};

/// Finds the triangles across the edges, and the vertices that edges join to each vertex.
void join_neighbours(TriangleMesh& mesh) {
  const std::vector<FaceSide> sides = sorted_sides(mesh.triangles);
  mesh.neighbours.assign(mesh.triangles.size(), {no_index, no_index, no_index});
  mesh.ring_begin.assign(mesh.vertices.size() + 1, 0);
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(sides.size() / 2 + 1);
  for (auto side = sides.begin(); side != sides.end();) {
    const auto past = std::find_if(side, sides.end(), [&](const FaceSide& other) {
      return other.lesser_end() != side->lesser_end() || other.greater_end() != side->greater_end();
    });
    const FaceSide& last = *(past - 1);
    if (past - side == 2 && side->is_reverse_of(last)) {
      mesh.neighbours[side->face][side->corner] = last.face;
      mesh.neighbours[last.face][last.corner] = side->face;
    }
    edges.push_back({side->lesser_end(), side->greater_end()});
    for (const std::uint32_t vertex : edges.back()) ++mesh.ring_begin[vertex + 1];
    side = past;
  }
  std::partial_sum(mesh.ring_begin.begin(), mesh.ring_begin.end(), mesh.ring_begin.begin());
  // List the edges in their order, so that each vertex gets its neighbours in ascending order.
  mesh.ring.resize(mesh.ring_begin.back());
  std::vector<std::uint32_t> next(mesh.ring_begin.begin(), mesh.ring_begin.end() - 1);
  for (const auto& [lesser, greater] : edges) {
    mesh.ring[next[lesser]++] = greater;
    mesh.ring[next[greater]++] = lesser;
  }
}

}  // namespace

std::vector<std::uint32_t> welded(std::span<const Vector3> points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::uint32_t> first = order;
  // Leave out points with a NaN, which have no position in an order and equal no other.
  std::erase_if(order, [&](std::uint32_t i) { return points[i].hasNaN(); });
  std::ranges::sort(
      order, {}, [&](std::uint32_t i) { return std::tuple(points[i].x(), points[i].y(), points[i].z(), i); });
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (points[order[k]] == points[order[k - 1]]) first[order[k]] = first[order[k - 1]];
  }
  return first;
}

std::vector<Vector3> distinct(std::span<const Vector3> points) {
  const std::vector<std::uint32_t> first = welded(points);
  std::vector<Vector3> result;
  result.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (first[i] == i) result.push_back(points[i]);
  }
  return result;
}

bool are_paired(std::span<const FaceSide> sides) {
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    if (i + 1 == sides.size() || !sides[i].is_reverse_of(sides[i + 1])) return false;
  }
  return true;
}

void require_near(std::span<const Vector3> points, const std::string& what, const char* kind) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Products of three larger lengths leave the range in which they are exact to rounding.
    if (points[i].allFinite() && points[i].cwiseAbs().maxCoeff() <= 1e9) continue;
    throw Error("{}: vertex {} is at {:.6g} {:.6g} {:.6g}; {} needs finite coordinates within ±1e9 m", what,
                i, points[i].x(), points[i].y(), points[i].z(), kind);
  }
}

TriangleMesh make_triangle_mesh(std::span<const Vector3> positions, std::span<const Triangle> triangles,
                                const std::string& what, bool two_sided) {
  require_near(positions, what, "a triangle mesh");
  TriangleMesh mesh;
  mesh.two_sided = two_sided;
  mesh.vertices.assign(positions.begin(), positions.end());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t corner : triangles[t]) {
      if (corner < positions.size()) continue;
      throw Error("{}: triangle {} has the vertex {}; there are {}", what, t, corner, positions.size());
    }
    if (has_area(positions, triangles[t])) mesh.triangles.push_back(triangles[t]);
  }
  if (mesh.triangles.empty()) throw Error(what + ": a triangle mesh needs a triangle with an area");
  weld(mesh);

  const std::vector<std::uint32_t> order = TreeBuilder(mesh).build();
  std::vector<Triangle> ordered;
  ordered.reserve(order.size());
  for (const std::uint32_t t : order) ordered.push_back(mesh.triangles[t]);
  mesh.triangles = std::move(ordered);
  for (const Triangle& triangle : mesh.triangles) {
    mesh.normals.push_back(area_vector(mesh.vertices, triangle).normalized());
  }
  join_neighbours(mesh);
  return mesh;
}

TriangleMesh make_rectangle(double size_x, double size_z, bool two_sided) {
  if (!(size_x > 0) || !(size_z > 0)) throw Error("a plane needs positive sizes");
  constexpr double largest = 20e3;
  const double x = std::min(size_x, largest) / 2;
  const double z = std::min(size_z, largest) / 2;
  const std::array<Vector3, 4> corners = {Vector3(-x, 0, -z), Vector3(-x, 0, z), Vector3(x, 0, z),
                                          Vector3(x, 0, -z)};
  return make_triangle_mesh(corners, std::array<Triangle, 2>{{{0, 1, 2}, {0, 2, 3}}}, "plane", two_sided);
}

void find_triangles(const TriangleMesh& mesh, const Bounds& box, std::vector<std::uint32_t>& out) {
  // Nodes to visit. The tree halves at every level, so it is no deeper than the bits of an index.
  std::array<std::uint32_t, 64> open;
  std::size_t count = 0;
  open[count++] = 0;
  while (count > 0) {
    const TriangleMesh::Node& node = mesh.nodes[open[--count]];
    if (!node.bounds.intersects(box)) continue;
    if (node.count == 0) {
      open[count++] = node.first + 1;
      open[count++] = node.first;
      continue;
    }
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t) {
      if (triangle_bounds(mesh, mesh.triangles[t]).intersects(box)) out.push_back(t);
    }
  }
}

}  // namespace substep
