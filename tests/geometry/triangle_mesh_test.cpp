#include "sim/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/error.h"
#include "sim/geometry/convex_hull.h"
#include "tests/error_message.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

/// Neighbouring triangles share a leaf in any order of the file, so that a search visits few leaves.
TEST(TriangleMesh, LeavesHoldNeighbours) {
  const TriangleMesh ordered = test::flat_mesh(16, 0.25, 0);
  std::vector<Triangle> triangles = ordered.triangles;
  std::mt19937 random(3);
  std::ranges::shuffle(triangles, random);
  const TriangleMesh mesh = make_triangle_mesh(ordered.vertices, triangles, "shuffled");
  double area = 0;
  for (const TriangleMesh::Node& node : mesh.nodes) {
    const Vector3 size = node.bounds.sizes();
    if (node.count > 0) area += size.x() * size.z();
  }
  EXPECT_LT(area, 1.5 * 16);  // of 16 m²; measured 16
}

TEST(TriangleMesh, RefusesDegenerateMeshes) {
  const std::vector<Vector3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  const std::vector<Triangle> triangle = {{0, 1, 2}};
  EXPECT_NO_THROW(make_triangle_mesh(corners, triangle, "m"));
  EXPECT_THROW(make_triangle_mesh(corners, std::vector<Triangle>{{0, 1, 3}}, "m"), Error);
  EXPECT_THROW(make_triangle_mesh(corners, std::vector<Triangle>{{0, 1, 1}}, "m"), Error);
  EXPECT_THROW(make_triangle_mesh({}, {}, "m"), Error);
  EXPECT_THROW(make_triangle_mesh(std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, triangle, "m"),
               Error);
  EXPECT_THROW(
      make_triangle_mesh(std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 0, std::nan("")}}, triangle, "m"),
      Error);
  EXPECT_THROW(make_rectangle(0, 1, false), Error);
  EXPECT_EQ(test::message_of([&] {
              make_triangle_mesh(corners, std::vector<Triangle>{{0, 1, 3}}, "hill.gltf: /meshes/2");
            }),
            "hill.gltf: /meshes/2: triangle 0 has the vertex 3; there are 3");
}

TEST(TriangleMesh, FindsSameTrianglesAsBruteForce) {
  std::mt19937 random(7);
  const Polytope hull = test::random_hull(random, 400);
  const TriangleMesh mesh = make_triangle_mesh(hull.vertices, test::triangles_of(hull), "hull");
  std::vector<std::uint32_t> found;
  int total = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Vector3 lower = test::random_point(random, 2.5);
    const Bounds box = {lower, lower + Vector3::Constant(0.8)};
    found.clear();
    find_triangles(mesh, box, found);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle& c = mesh.triangles[t];
      const Vector3 low = mesh.vertices[c[0]].cwiseMin(mesh.vertices[c[1]]).cwiseMin(mesh.vertices[c[2]]);
      const Vector3 high = mesh.vertices[c[0]].cwiseMax(mesh.vertices[c[1]]).cwiseMax(mesh.vertices[c[2]]);
      if ((low.array() <= box.max().array()).all() && (box.min().array() <= high.array()).all()) {
        expected.push_back(t);
      }
    }
    ASSERT_EQ(found, expected);
    total += static_cast<int>(found.size());
  }
  EXPECT_GT(total, 1000);
}

TEST(TriangleMesh, JoinsSharedCorners) {
  // Corners stored once per face, as files do.
  const Polytope solid = box({1, 1, 1});
  std::vector<Vector3> corners;
  std::vector<Triangle> triangles;
  const TriangleMesh joined = make_triangle_mesh(solid.vertices, test::triangles_of(solid), "box");
  for (const Triangle& triangle : joined.triangles) {
    const auto first = static_cast<std::uint32_t>(corners.size());
    for (const std::uint32_t corner : triangle) corners.push_back(joined.vertices[corner]);
    triangles.push_back({first, first + 1, first + 2});
  }
  const TriangleMesh mesh = make_triangle_mesh(corners, triangles, "box");
  EXPECT_EQ(mesh.vertices.size(), 8U);
  EXPECT_EQ(mesh.triangles.size(), 12U);
  for (const auto& sides : mesh.neighbours) {
    for (const std::uint32_t neighbour : sides) EXPECT_NE(neighbour, no_index);
  }
}

TEST(WeldedPoints, JoinPointsAtOnePosition) {
  const double nan = std::nan("");
  const std::vector<Vector3> points = {{1, 2, 3},   {0, 0, 0},   {1, 2, 3},   {0, -0.0, 0},
                                       {nan, 0, 0}, {nan, 0, 0}, {1, 2, 3.5}, {1, 2, 3}};
  EXPECT_EQ(welded(points), (std::vector<std::uint32_t>{0, 1, 0, 1, 4, 5, 6, 0}));
  EXPECT_EQ(distinct(std::span(points).first(4)), (std::vector<Vector3>{points[0], points[1]}));
}

}  // namespace
}  // namespace substep
