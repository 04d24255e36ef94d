#include "sim/geometry/convex_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "sim/error.h"
#include "sim/geometry/mass_properties.h"
#include "tests/error_message.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

/// Expects Euler's formula, outward unit normals, vertices on their own faces and below all others, and edges
/// between the faces that they name.
void expect_sound(const Polytope& polytope, double tolerance) {
  EXPECT_EQ(polytope.vertices.size() + polytope.face_count(), polytope.edges.size() + 2);
  ASSERT_EQ(polytope.face_begin.size(), polytope.face_count() + 1);
  ASSERT_EQ(polytope.face_offsets.size(), polytope.face_count());
  ASSERT_EQ(polytope.edge_faces.size(), polytope.edges.size());
  std::set<std::uint32_t> used;
  for (std::size_t f = 0; f < polytope.face_count(); ++f) {
    EXPECT_NEAR(polytope.face_normals[f].norm(), 1, 1e-14);
    EXPECT_GT(polytope.face_offsets[f], polytope.face_normals[f].dot(polytope.centre));
    EXPECT_GE(polytope.face_begin[f + 1] - polytope.face_begin[f], 3U);
    for (const Vector3& vertex : polytope.vertices) {
      EXPECT_LE(polytope.face_normals[f].dot(vertex), polytope.face_offsets[f] + tolerance);
    }
    for (std::uint32_t i = polytope.face_begin[f]; i < polytope.face_begin[f + 1]; ++i) {
      const std::uint32_t corner = polytope.face_vertices[i];
      used.insert(corner);
      EXPECT_NEAR(polytope.face_normals[f].dot(polytope.vertices[corner]), polytope.face_offsets[f],
                  tolerance);
    }
  }
  EXPECT_EQ(used.size(), polytope.vertices.size());
  for (std::size_t e = 0; e < polytope.edges.size(); ++e) {
    const auto has = [&](std::uint32_t f, std::uint32_t from, std::uint32_t to) {
      const std::uint32_t begin = polytope.face_begin[f];
      const std::uint32_t count = polytope.face_begin[f + 1] - begin;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (polytope.face_vertices[begin + i] == from &&
            polytope.face_vertices[begin + (i + 1) % count] == to) {
          return true;
        }
      }
      return false;
    };
    EXPECT_TRUE(has(polytope.edge_faces[e][0], polytope.edges[e][0], polytope.edges[e][1]));
    EXPECT_TRUE(has(polytope.edge_faces[e][1], polytope.edges[e][1], polytope.edges[e][0]));
  }
  for (const Vector3& vertex : polytope.vertices) {
    EXPECT_LE((vertex - polytope.centre).norm(), polytope.bounding_radius * (1 + 1e-15));
  }
}

TEST(ConvexHull, DodecahedronHasTwelveFaces) {
  const std::vector<Vector3> points = test::dodecahedron_points();
  const Polytope hull = convex_hull(points, "dodecahedron");
  EXPECT_EQ(hull.vertices.size(), 20U);
  EXPECT_EQ(hull.face_count(), 12U);
  EXPECT_EQ(hull.edges.size(), 30U);
  expect_sound(hull, 1e-14);
  // The inscribed ball of the dodecahedron with edges 2/φ: φ²/√(3 − φ) / 2 of the edge.
  constexpr double phi = std::numbers::phi;
  EXPECT_NEAR(hull.inner_radius, 2 / phi * phi * phi / (2 * std::sqrt(3 - phi)),
              1e-14);  // measured 2e-16
  // Vertices are exactly those given.
  for (const Vector3& vertex : hull.vertices) EXPECT_NE(std::ranges::find(points, vertex), points.end());
}

TEST(ConvexHull, GridCubeHasSixFaces) {
  std::vector<Vector3> points;
  for (int copy = 0; copy < 21; ++copy) {
    for (int i = 0; i < 125; ++i) points.push_back(0.1 * test::grid_point(i, 5));
  }
  const Polytope hull = convex_hull(points, "grid");
  EXPECT_EQ(hull.vertices.size(), 8U);
  EXPECT_EQ(hull.face_count(), 6U);
  EXPECT_EQ(hull.edges.size(), 12U);
  expect_sound(hull, 1e-15);
}

TEST(ConvexHull, FacesOfFloatCoordinatesStayWhole) {
  // A turned prism as a mesh file has it: no face's corners are exactly in one plane.
  const Polytope prism = test::transformed(cylinder(1, 0.5, 0.5), {{3, 2, 1}, test::turn(1, {1, 2, 3})});
  std::vector<Vector3> points = prism.vertices;
  for (Vector3& point : points) point = point.cast<float>().cast<double>();
  const Polytope hull = convex_hull(points, "prism");
  EXPECT_EQ(hull.vertices.size(), 64U);
  EXPECT_EQ(hull.face_count(), 34U);
  expect_sound(hull, 1e-6);  // measured 4e-7: the rounding of coordinates near 4
}

TEST(ConvexHull, HoldsManyPointsOnSphere) {
  std::mt19937 random(3);
  std::vector<Vector3> points;
  points.reserve(1000);
  for (int i = 0; i < 1000; ++i) points.push_back(test::random_orientation(random).vec().normalized());
  const Polytope hull = convex_hull(points, "sphere");
  EXPECT_EQ(hull.vertices.size(), 1000U);
  expect_sound(hull, 1e-6);
  EXPECT_NEAR(mass_properties(hull).mass, 4 * std::numbers::pi / 3,
              0.06);  // measured 0.05: chords
}

TEST(ConvexHull, KeepsShapeAtAnySizeAndPosition) {
  for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    std::vector<Vector3> points = test::dodecahedron_points();
    for (Vector3& point : points) point = size * (point + Vector3(100, -50, 20));
    const Polytope hull = convex_hull(points, "dodecahedron");
    EXPECT_EQ(hull.face_count(), 12U) << size;
    expect_sound(hull, 1e-12 * size);
  }
}

/// Returns the message that refuses the hull of these points.
std::string refusal(const std::vector<Vector3>& points) {
  return test::message_of([&] { convex_hull(points, "a.gltf: /meshes/2"); });
}

TEST(ConvexHull, RefusesFlatPoints) {
  std::mt19937 random(7);
  const std::string thin = "a.gltf: /meshes/2: its convex hull is thinner than 1e-6 of its size of ";
  std::vector<Vector3> flat;
  std::vector<Vector3> nearly_flat;
  std::vector<Vector3> line;
  for (int i = 0; i < 40; ++i) {
    flat.emplace_back(i, i * i, 3 * i);
    nearly_flat.push_back(test::random_point(random, 1).cwiseProduct(Vector3(1, 1, 1e-8)));
    line.emplace_back(i, 2 * i, 3 * i);
  }
  EXPECT_TRUE(refusal(flat).starts_with(thin)) << refusal(flat);
  EXPECT_TRUE(refusal(nearly_flat).starts_with(thin)) << refusal(nearly_flat);
  EXPECT_TRUE(refusal(line).starts_with(thin)) << refusal(line);
  EXPECT_TRUE(refusal(std::vector<Vector3>(9, Vector3(1, 2, 3))).starts_with(thin));
  EXPECT_EQ(refusal({Vector3(1, 2, 3)}),
            "a.gltf: /meshes/2: a convex hull needs at least 4 vertices, there are 1");
  EXPECT_EQ(refusal({}), "a.gltf: /meshes/2: a convex hull needs at least 4 vertices, there are 0");
}

TEST(ConvexHull, RefusesPointsNotFiniteOrTooFar) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity, 1e300, -2e9}) {
    std::vector<Vector3> points = test::dodecahedron_points();
    points[3].y() = bad;
    EXPECT_TRUE(refusal(points).starts_with("a.gltf: /meshes/2: vertex 3 is at ")) << refusal(points);
  }
}

TEST(ConvexHull, HostilePointsAreHulledOrRefused) {
  std::mt19937 random(11);
  int hulls = 0;
  for (int trial = 0; trial < 400; ++trial) {
    // Draw grids, near-duplicates and slivers, on which hull algorithms fail.
    std::vector<Vector3> points;
    const double noise = std::pow(10.0, -1.0 - trial % 16);
    const Vector3 stretch(1, trial % 3 == 0 ? 1 : 1e-3, trial % 5 == 0 ? 1e-4 : 1);
    for (int i = 0; i < 60; ++i) {
      points.push_back(test::grid_point(i, 4).cwiseProduct(stretch) + test::random_point(random, noise));
    }
    try {
      const Polytope hull = convex_hull(points, "points");
      ++hulls;
      ASSERT_EQ(hull.vertices.size() + hull.face_count(), hull.edges.size() + 2) << trial;
      ASSERT_GT(mass_properties(hull).mass, 0) << trial;
      for (std::size_t f = 0; f < hull.face_count(); ++f) {
        ASSERT_NEAR(hull.face_normals[f].norm(), 1, 1e-12);
        for (const Vector3& point : points) {
          ASSERT_LE(hull.face_normals[f].dot(point), hull.face_offsets[f] + 1e-5) << trial;
        }
      }
    } catch (const Error&) {
      continue;
    }
  }
  EXPECT_GT(hulls, 390);  // measured 400
}

TEST(Box, IsABox) {
  const Polytope solid = box({1, 2, 3});
  expect_sound(solid, 0);
  EXPECT_EQ(solid.face_count(), 6U);
  EXPECT_DOUBLE_EQ(mass_properties(solid).mass, 6);
  EXPECT_DOUBLE_EQ(solid.inner_radius, 0.5);
  EXPECT_TRUE(solid.half_box.has_value());
  EXPECT_THROW(box({1, 0, 1}), Error);
  EXPECT_THROW(box({1, std::numeric_limits<double>::quiet_NaN(), 1}), Error);
}

TEST(Cylinder, HasVerticesOnCircles) {
  const Polytope straight = cylinder(2, 0.5, 0.5);
  expect_sound(straight, 1e-15);
  EXPECT_EQ(straight.vertices.size(), 64U);
  EXPECT_EQ(straight.face_count(), 34U);
  for (const Vector3& vertex : straight.vertices) {
    EXPECT_DOUBLE_EQ(std::hypot(vertex.x(), vertex.z()), 0.5);
    EXPECT_DOUBLE_EQ(std::abs(vertex.y()), 1);
  }
  expect_sound(cylinder(2, 0.5, 0.25), 1e-15);
  const Polytope cone = cylinder(2, 0.5, 0, 16);
  expect_sound(cone, 1e-15);
  EXPECT_EQ(cone.vertices.size(), 17U);
  EXPECT_DOUBLE_EQ(std::ranges::max(cone.vertices, {}, [](const Vector3& v) { return v.y(); }).y(), 1);
  const Polytope upside_down = cylinder(2, 0, 0.5, 16);
  expect_sound(upside_down, 1e-15);
  EXPECT_DOUBLE_EQ(mass_properties(cone).mass, mass_properties(upside_down).mass);
  EXPECT_THROW(cylinder(0, 1, 1), Error);
  EXPECT_THROW(cylinder(1, 0, 0), Error);
  EXPECT_THROW(cylinder(1, 1, 1, 2), Error);
}

TEST(Scaled, KeepsBoxesAndValidHulls) {
  const Polytope solid = scaled(box({1, 1, 1}), {1, 2, 3});
  expect_sound(solid, 0);
  EXPECT_EQ(solid.half_box, Vector3(0.5, 1, 1.5));
  expect_sound(scaled(convex_hull(test::dodecahedron_points(), "d"), {1, 5, 0.2}), 1e-14);
  EXPECT_THROW(scaled(solid, {1, -1, 1}), Error);
}

TEST(TransformedPolytope, KeepsMass) {
  const Pose pose = {{1, 2, 3}, test::turn(0.7, {1, -1, 2})};
  const Polytope moved = test::transformed(box({1, 2, 3}), pose);
  expect_sound(moved, 1e-14);
  EXPECT_DOUBLE_EQ(mass_properties(moved).mass, 6);
}

}  // namespace
}  // namespace substep
