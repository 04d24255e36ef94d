#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "sim/geometry/contact.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using test::contacts;
using test::pi;
using test::turn;
using test::upright;
using test::usual_margin;

/// Returns two slopes that meet in the z axis; each falls by `slope` away from it, or rises if negative.
TriangleMesh ridge(double slope) {
  std::vector<Vector3> positions;
  std::vector<Triangle> triangles;
  for (int k = -8; k <= 8; ++k) {
    for (const double x : {-4.0, -0.5, 0.0, 0.5, 4.0}) {
      positions.emplace_back(x, -slope * std::abs(x), 0.5 * k);
    }
  }
  for (std::uint32_t k = 0; k < 16; ++k) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t at = 5 * k + i;
      triangles.push_back({at, at + 5, at + 6});
      triangles.push_back({at, at + 6, at + 1});
    }
  }
  return make_triangle_mesh(positions, triangles, "ridge");
}

TriangleMesh mesh_of(const Polytope& polytope) {
  return make_triangle_mesh(polytope.vertices, test::triangles_of(polytope), "solid");
}

std::vector<Shape> shapes() {
  return {Sphere{0.3},
          Capsule{0.3, 0.2},
          make_tapered_capsule(0.6, 0.3, 0.1),
          make_cylinder(0.6, 0.3, 0.3),
          make_cylinder(0.6, 0.3, 0.1),
          box({0.6, 0.5, 0.4}),
          test::dodecahedron()};
}

/// Returns the depth of a shape in the half-space below a plane through `on` with this normal, by contacts
/// with a plane.
double depth_below(const Shape& shape, const Pose& pose, const Vector3& on, const Vector3& normal) {
  const Pose plane = {on, shortest_rotation(Vector3::UnitY(), normal)};
  return test::lowest_distance(contacts(shape, pose, Plane{}, plane, 10));
}

TEST(MeshContacts, FlatMeshMatchesPlane) {
  std::mt19937 random(1);
  for (const double uneven : {0.0, 0.3}) {
    const TriangleMesh mesh = test::flat_mesh(16, 0.25, uneven);
    for (const Shape& shape : shapes()) {
      double worst = 0;
      for (int trial = 0; trial < 400; ++trial) {
        Pose pose = {test::random_point(random, 0.7), test::random_orientation(random)};
        // Lower the shape until it is 1 mm deep, or 1 mm above.
        pose.position.y() -=
            depth_below(shape, pose, Vector3::Zero(), Vector3::UnitY()) + (trial % 2 == 0 ? 1e-3 : -1e-3);
        const auto on_mesh = contacts(shape, pose, mesh, {}, usual_margin);
        const auto on_plane = contacts(shape, pose, Plane{}, {}, usual_margin);
        ASSERT_EQ(test::complaint(on_mesh, usual_margin), "");
        ASSERT_FALSE(on_mesh.empty()) << shape.index() << ' ' << trial;
        for (const ContactPoint& point : on_mesh) {
          ASSERT_EQ(point.normal, Vector3::UnitY()) << shape.index() << ' ' << trial;
        }
        worst = std::max(worst, std::abs(test::lowest_distance(on_mesh) - test::lowest_distance(on_plane)));
      }
      EXPECT_LT(worst, 1e-14) << shape.index();  // measured 1e-15
    }
  }
}

TEST(MeshContacts, RollingSphereHasOneContact) {
  // Move in steps that hit corners, edges and faces.
  for (const double uneven : {0.0, 0.3}) {
    const TriangleMesh mesh = test::flat_mesh(16, 0.25, uneven);
    for (int i = 0; i < 3000; ++i) {
      const Vector3 at(0.001 * i - 1.5, 0.2999, uneven == 0 ? 0.0005 * i - 0.75 : 0.1);
      const auto points = contacts(Sphere{0.3}, {at, upright}, mesh, {}, usual_margin);
      ASSERT_EQ(points.size(), 1U) << i;
      ASSERT_EQ(points[0].normal, Vector3::UnitY()) << i;
      ASSERT_NEAR(points[0].distance, -1e-4, 1e-15);
      ASSERT_NEAR(points[0].on_b.x(), at.x(), 1e-15);
    }
  }
}

TEST(MeshContacts, KeepBothEndsOfRollingCapsule) {
  // The second mesh is off by as much as single precision is at 5 m.
  for (const double rough : {0.0, 4e-7}) {
    std::mt19937 random(2);
    TriangleMesh mesh = test::flat_mesh(16, 0.25, 0);
    std::vector<Vector3> positions = mesh.vertices;
    for (Vector3& position : positions) position.y() += rough * test::random_point(random, 1).y();
    mesh = make_triangle_mesh(positions, mesh.triangles, "rough");
    double worst = 0;
    for (int i = 0; i < 3000; ++i) {
      const Pose turned = {Vector3::Zero(), test::random_orientation(random)};
      const Pose pose = {{0.00097 * i - 1.5, 0.1499, 0.07}, turn(pi / 2, {1, 0, 0})};
      const auto points = contacts(Capsule{0.2, 0.15}, turned * pose, mesh, turned, usual_margin);
      ASSERT_EQ(points.size(), 2U) << i << ' ' << rough;
      worst = std::max(worst, std::abs((points[0].on_a - points[1].on_a).norm() - 0.4));
    }
    EXPECT_LT(worst, 7e-6) << rough;  // measured 6e-16 and 5e-7
  }
}

TEST(MeshContacts, SlidingBoxHasFourCorners) {
  const Polytope solid = box({0.6, 0.4, 0.5});
  for (const double uneven : {0.0, 0.3}) {
    const TriangleMesh mesh = test::flat_mesh(16, 0.25, uneven);
    for (int i = 0; i < 500; ++i) {
      const Pose pose = {{0.005 * i - 1.25, 0.1999, 0.03}, turn(0.01 * i, {0, 1, 0})};
      const auto points = contacts(solid, pose, mesh, {}, usual_margin);
      ASSERT_EQ(points.size(), 4U) << i << ' ' << uneven;
      for (const ContactPoint& point : points) {
        ASSERT_EQ(point.normal, Vector3::UnitY());
        ASSERT_NEAR(point.distance, -1e-4, 1e-15);
        const Vector3 corner = pose.inverse() * point.on_a;
        ASSERT_LT((corner.cwiseAbs() - Vector3(0.3, 0.2, 0.25)).norm(), 1e-12);
      }
    }
  }
}

TEST(MeshContacts, ConvexRidgeTouchesWithEdge) {
  const TriangleMesh mesh = ridge(0.5);
  const Vector3 right = Vector3(0.5, 1, 0).normalized();
  // Balance shapes on the ridge: a sphere has one contact at the edge, a shape with a side along it two.
  const auto ball = contacts(Sphere{0.3}, {{0, 0.299, 0.1}, upright}, mesh, {}, usual_margin);
  ASSERT_EQ(ball.size(), 1U);
  EXPECT_LT((ball[0].normal - Vector3::UnitY()).norm(), 1e-9);
  EXPECT_NEAR(ball[0].distance, -1e-3, 1e-12);
  const auto solid = contacts(box({0.6, 0.5, 0.4}), {{0.1, 0.249, 0.1}, upright}, mesh, {}, usual_margin);
  ASSERT_EQ(solid.size(), 2U);
  for (const ContactPoint& point : solid) {
    EXPECT_LT((point.normal - Vector3::UnitY()).norm(), 1e-12);
    EXPECT_NEAR(point.distance, -1e-3, 1e-12);
    EXPECT_NEAR(point.on_b.x(), 0, 1e-12);
  }
  // Roll a sphere over the edge: its normal turns from one face's to the other's, without a jump.
  Vector3 before = Vector3::Zero();
  for (int i = 0; i <= 2000; ++i) {
    const double x = -0.5 + 5e-4 * i;
    // Keep the centre 0.3 from the surface: over a face or on the arc about the edge.
    const double edge_of_arc = 0.3 * right.x();
    const double y =
        std::abs(x) <= edge_of_arc ? std::sqrt(0.09 - x * x) : (0.3 - std::abs(x) * right.x()) / right.y();
    const auto points = contacts(Sphere{0.3}, {{x, y, 0.1}, upright}, mesh, {}, usual_margin);
    ASSERT_GE(points.size(), 1U) << x;
    for (const ContactPoint& point : points) EXPECT_GE(point.distance, -1e-12) << x;
    const auto nearest = std::ranges::min_element(points, {}, &ContactPoint::distance);
    EXPECT_NEAR(nearest->distance, 0, 3e-4) << x;  // 1e-3 of the size: a face is preferred that far
    if (i > 0) {
      EXPECT_LT((nearest->normal - before).norm(), 0.05) << x;
    }
    before = nearest->normal;
  }
}

TEST(MeshContacts, ConcaveValleyTouchesWithBothSlopes) {
  const TriangleMesh mesh = ridge(-0.5);
  const Vector3 left = Vector3(0.5, 1, 0).normalized();
  const auto points = contacts(Sphere{0.3}, {{0, 0.299 / left.y(), 0.1}, upright}, mesh, {}, usual_margin);
  ASSERT_EQ(points.size(), 2U);
  for (const ContactPoint& point : points) {
    EXPECT_NEAR(point.distance, -1e-3, 1e-12);
    EXPECT_NEAR(std::abs(point.normal.x()), left.x(), 1e-12);
    EXPECT_NEAR(point.normal.y(), left.y(), 1e-12);
  }
  for (const Shape& shape : shapes()) {
    for (const ContactPoint& point : contacts(shape, {{0.05, 0.5, 0.1}, upright}, mesh, {}, 0.3)) {
      // Require the normals of the slopes: the valley's edge does not push.
      EXPECT_NEAR(std::abs(point.normal.x()), left.x(), 1e-12) << shape.index();
    }
  }
}

TEST(MeshContacts, ClosedMeshMatchesItsHull) {
  std::mt19937 random(5);
  int touching = 0;
  int beyond = 0;
  for (const Polytope& solid : {box({2, 1, 1.5}), test::dodecahedron()}) {
    const TriangleMesh mesh = mesh_of(solid);
    for (const Shape& shape : shapes()) {
      for (int trial = 0; trial < 1000; ++trial) {
        const Pose pose = {test::random_point(random, 2), test::random_orientation(random)};
        const auto on_solid = contacts(shape, pose, solid, {}, usual_margin);
        const double depth = test::lowest_distance(on_solid);
        // Skip deeper overlaps: a triangle knows only its neighbours, not the solid.
        if (depth < -0.05) continue;
        const auto on_mesh = contacts(shape, pose, mesh, {}, usual_margin);
        ASSERT_EQ(test::complaint(on_mesh, usual_margin), "");
        if (on_solid.empty()) {
          EXPECT_TRUE(on_mesh.empty()) << shape.index() << ' ' << trial;
          continue;
        }
        ++touching;
        if (depth < usual_margin - 5e-3) {
          ASSERT_FALSE(on_mesh.empty()) << shape.index() << ' ' << trial << ' ' << depth;
        }
        if (on_mesh.empty()) continue;
        // Allow for the preference for faces, of mesh and of hull.
        if (std::abs(test::lowest_distance(on_mesh) - depth) > 0.1 * std::abs(depth) + 3e-3) ++beyond;
      }
    }
  }
  EXPECT_GT(touching, 300);
  // A triangle knows only its neighbours: near a corner of the solid its normal may differ from the hull's.
  EXPECT_LE(beyond, touching / 100);  // measured 3 of 474
}

TEST(MeshContacts, OneSidedMeshPushesFromFront) {
  const TriangleMesh one = make_rectangle(4, 4, false);
  const TriangleMesh both = make_rectangle(4, 4, true);
  for (const Shape& shape : shapes()) {
    EXPECT_TRUE(contacts(shape, {{0.1, -0.05, 0.2}, upright}, one, {}, usual_margin).empty());
    const auto points = contacts(shape, {{0.1, -0.05, 0.2}, upright}, both, {}, usual_margin);
    ASSERT_FALSE(points.empty()) << shape.index();
    for (const ContactPoint& point : points) EXPECT_EQ(point.normal, Vector3(-Vector3::UnitY()));
  }
}

TEST(MeshContacts, BorderTouchesWithEdge) {
  const TriangleMesh mesh = make_rectangle(2, 2, true);
  // Put the sphere beside the sheet, at its height.
  const auto points = contacts(Sphere{0.3}, {{1.29, 0, 0.1}, upright}, mesh, {}, usual_margin);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_LT((points[0].normal - Vector3::UnitX()).norm(), 1e-9);
  EXPECT_NEAR(points[0].distance, -0.01, 1e-12);
}

TEST(MeshContacts, RingOfStripsPushesInwards) {
  // Make a ring like a fence around a shape: its top edge is open, its inner edges are concave.
  constexpr int sides = 96;
  constexpr double radius = 1.15;
  constexpr double top = 0.09;
  std::vector<Vector3> positions;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * pi * i / sides;
    for (const double y : {0.0, top})
      positions.emplace_back(radius * std::cos(angle), y, radius * std::sin(angle));
    const std::uint32_t next = (i + 1) % sides;
    triangles.push_back({2 * i, 2 * next, 2 * next + 1});
    triangles.push_back({2 * i, 2 * next + 1, 2 * i + 1});
  }
  const TriangleMesh ring = make_triangle_mesh(positions, triangles, "ring", true);
  const double inner_radius = radius * std::cos(pi / sides);
  int touching = 0;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const Shape& shape : {Shape(make_cylinder(0.12, 0.05, 0)), Shape(make_cylinder(0.12, 0.05, 0.05)),
                             Shape(make_cylinder(0.12, 0.05, 0.03)), Shape(box({0.1, 0.12, 0.1}))}) {
    for (int i = 0; i < 400; ++i) {
      const double depth = std::array{-1e-3, -1e-9, 0.0, 1e-9, 1e-5, 1e-3}[i % 6];
      const double angle = pi * any(random);
      const Vector3 outwards(std::cos(angle), 0, std::sin(angle));
      Pose pose = {0.5 * outwards,
                   Quaternion(any(random), any(random), any(random), any(random)).normalized()};
      // Put the shape at the ring's foot, against the ring.
      pose.position.y() += depth_below(shape, pose, Vector3::Zero(), Vector3::UnitY()) * -1;
      pose.position += (depth_below(shape, pose, inner_radius * outwards, -outwards) + depth) * outwards;
      for (const ContactPoint& point : contacts(shape, pose, ring, {}, usual_margin)) {
        ++touching;
        // Reject depths that do not exist, which wrong directions give, up to the ring's height. The ring
        // comes inwards by 2.8 mm within the reach of a shape's corners, 0.08 m to a side.
        EXPECT_GT(point.distance, -std::max(depth, 0.0) - 2.8e-3)
            << "shape " << shape.index() << ", " << i << ", at " << angle << " rad, depth " << depth
            << ": normal " << point.normal.transpose();
      }
    }
  }
  EXPECT_GT(touching, 1600);
}

}  // namespace
}  // namespace substep
