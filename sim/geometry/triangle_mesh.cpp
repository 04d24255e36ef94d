#include "sim/geometry/triangle_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "sim/error.h"
#include "sim/geometry/welded_points.h"

namespace substep {
namespace {

/// Metres. Beyond, products of three lengths leave the range in which they are exact to rounding.
constexpr double largest_coordinate = 1e9;

constexpr std::uint32_t leaf_size = 4;

/// Fraction of its longest side below which a triangle's height is too small for an exact normal.
constexpr double smallest_height = 1e-10;

/// Gives each vertex the index of the first at its position, and removes unused vertices.
void weld(TriangleMesh& mesh) {
  const std::vector<Vector3>& given = mesh.vertices;
  const std::vector<std::uint32_t> first = welded(given);
  std::vector<std::uint32_t> index(given.size(), TriangleMesh::none);
  std::vector<Vector3> kept;
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      std::uint32_t& to = index[first[corner]];
      if (to == TriangleMesh::none) {
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

/// Splits triangles at the median of their middles until leaves are small; a leaf's are neighbours in
/// the order that it gives.
class TreeBuilder {
 public:
  explicit TreeBuilder(TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    boxes_.reserve(order_.size());
    middles_.reserve(order_.size());
    for (const Triangle& triangle : mesh.triangles) {
      const Vector3& a = mesh.vertices[triangle[0]];
      const Vector3& b = mesh.vertices[triangle[1]];
      const Vector3& c = mesh.vertices[triangle[2]];
      boxes_.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
      middles_.emplace_back(boxes_.back().lower + boxes_.back().upper);
    }
  }

  /// The triangles in the order of the leaves.
  std::vector<std::uint32_t> build() {
    mesh_.nodes.assign(1, {});
    split(0, 0, static_cast<std::uint32_t>(order_.size()));
    return std::move(order_);
  }

 private:
  struct Place {
    double middle;  // twice, along the axis of the split
    std::uint32_t triangle;
    bool operator<(const Place& other) const {
      // Avoid a branch that would be mispredicted half the time.
      return (static_cast<int>(middle < other.middle) |
              (static_cast<int>(middle == other.middle) & static_cast<int>(triangle < other.triangle))) != 0;
    }
  };

  void split(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    const std::span<std::uint32_t> triangles(order_.data() + begin, order_.data() + end);
    if (triangles.size() <= leaf_size) {
      // Sort each half: the library that selected its triangles leaves them in any order.
      std::ranges::sort(triangles);
      Bounds box = boxes_[triangles[0]];
      for (const std::uint32_t t : triangles.subspan(1)) box = united(box, boxes_[t]);
      mesh_.nodes[node] = {box, begin, end - begin};
      return;
    }
    Bounds middles = {middles_[triangles[0]], middles_[triangles[0]]};
    for (const std::uint32_t t : triangles) {
      middles.lower = middles.lower.cwiseMin(middles_[t]);
      middles.upper = middles.upper.cwiseMax(middles_[t]);
    }
    Eigen::Index axis = 0;
    (middles.upper - middles.lower).maxCoeff(&axis);
    places_.clear();
    for (const std::uint32_t t : triangles) places_.push_back({middles_[t][axis], t});
    const std::uint32_t half = begin + (end - begin) / 2;
    std::nth_element(places_.begin(), places_.begin() + (half - begin), places_.end());
    std::ranges::transform(places_, triangles.begin(), &Place::triangle);
    const auto first = static_cast<std::uint32_t>(mesh_.nodes.size());
    mesh_.nodes.resize(mesh_.nodes.size() + 2);
    split(first, begin, half);
    split(first + 1, half, end);
    mesh_.nodes[node].first = first;
    mesh_.nodes[node].bounds = united(mesh_.nodes[first].bounds, mesh_.nodes[first + 1].bounds);
  }

  static Bounds united(const Bounds& a, const Bounds& b) {
    return {a.lower.cwiseMin(b.lower), a.upper.cwiseMax(b.upper)};
  }

  TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Bounds> boxes_;
  std::vector<Vector3> middles_;  // twice
  std::vector<Place> places_;
};

void join_neighbours(TriangleMesh& mesh) {
  struct Side {
    std::uint32_t end;  // the greater one
    std::uint32_t triangle;
    std::uint32_t corner;
    bool leads_up;  // from the lesser end to the greater
  };
  const std::size_t vertices = mesh.vertices.size();
  // The sides by their lesser end, then by the greater: those of an edge together.
  std::vector<std::uint32_t> begin(vertices + 1, 0);
  for (const Triangle& corners : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++begin[std::min(corners[i], corners[(i + 1) % 3]) + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  std::vector<Side> sides(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t from = mesh.triangles[t][i];
      const std::uint32_t to = mesh.triangles[t][(i + 1) % 3];
      sides[next[std::min(from, to)]++] = {std::max(from, to), t, i, from < to};
    }
  }
  mesh.neighbours.assign(mesh.triangles.size(), {TriangleMesh::none, TriangleMesh::none, TriangleMesh::none});
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(sides.size() / 2 + 1);
  mesh.ring_begin.assign(vertices + 1, 0);
  for (std::uint32_t vertex = 0; vertex < vertices; ++vertex) {
    const std::span at(sides.data() + begin[vertex], sides.data() + begin[vertex + 1]);
    std::ranges::sort(at, {}, &Side::end);
    for (std::size_t i = 0; i < at.size();) {
      std::size_t past = i + 1;
      while (past < at.size() && at[past].end == at[i].end) ++past;
      if (past - i == 2 && at[i].leads_up != at[i + 1].leads_up) {
        mesh.neighbours[at[i].triangle][at[i].corner] = at[i + 1].triangle;
        mesh.neighbours[at[i + 1].triangle][at[i + 1].corner] = at[i].triangle;
      }
      edges.push_back({vertex, at[i].end});
      ++mesh.ring_begin[vertex + 1];
      ++mesh.ring_begin[at[i].end + 1];
      i = past;
    }
  }
  std::partial_sum(mesh.ring_begin.begin(), mesh.ring_begin.end(), mesh.ring_begin.begin());
  // In the edges' order each vertex gets first the lesser vertices around it, then the greater, each in
  // order.
  mesh.ring.resize(mesh.ring_begin.back());
  next.assign(mesh.ring_begin.begin(), mesh.ring_begin.end() - 1);
  for (const auto& [lesser, greater] : edges) {
    mesh.ring[next[lesser]++] = greater;
    mesh.ring[next[greater]++] = lesser;
  }
}

bool overlap(const Bounds& a, const Bounds& b) {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

}  // namespace

TriangleMesh make_triangle_mesh(std::span<const Vector3> positions, std::span<const Triangle> triangles,
                                const std::string& what, bool two_sided) {
  constexpr std::size_t most = TriangleMesh::none / 8;
  if (positions.size() > most || triangles.size() > most) {
    throw Error(fmt::format("{}: {} vertices and {} triangles are too many for a triangle mesh", what,
                            positions.size(), triangles.size()));
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    // Written so that NaN fails too.
    if (positions[i].cwiseAbs().maxCoeff() <= largest_coordinate && positions[i].allFinite()) continue;
    throw Error(
        fmt::format("{}: vertex {} is at {:.6g} {:.6g} {:.6g}; a triangle mesh needs finite "
                    "coordinates within ±1e9 m",
                    what, i, positions[i].x(), positions[i].y(), positions[i].z()));
  }
  TriangleMesh mesh;
  mesh.two_sided = two_sided;
  mesh.vertices.assign(positions.begin(), positions.end());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t corner : triangles[t]) {
      if (corner < positions.size()) continue;
      throw Error(
          fmt::format("{}: triangle {} has the vertex {}; there are {}", what, t, corner, positions.size()));
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
  // Halved at every level, so no deeper than the number of bits of an index.
  std::array<std::uint32_t, 64> open;
  std::size_t count = 0;
  open[count++] = 0;
  while (count > 0) {
    const TriangleMesh::Node& node = mesh.nodes[open[--count]];
    if (!overlap(node.bounds, box)) continue;
    if (node.count == 0) {
      open[count++] = node.first + 1;
      open[count++] = node.first;
      continue;
    }
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t) {
      const Triangle& corners = mesh.triangles[t];
      const Vector3& a = mesh.vertices[corners[0]];
      const Vector3& b = mesh.vertices[corners[1]];
      const Vector3& c = mesh.vertices[corners[2]];
      if (overlap({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)}, box)) out.push_back(t);
    }
  }
}

}  // namespace substep
