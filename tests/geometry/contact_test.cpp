// This is one file, since the pairs of resting shapes are one table of 80 rows.

#include "sim/geometry/contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "sim/geometry/triangle_mesh.h"
#include "sim/math/rotation.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

using test::complaint;
using test::contacts;
using test::dodecahedron;
using test::pi;
using test::turn;
using test::upright;
using test::usual_margin;

/// Returns the rotation that turns face 0 along `direction`.
Quaternion face_towards(const Polytope& polytope, const Vector3& direction) {
  return shortest_rotation(polytope.face_normals[0], direction);
}

TEST(Contacts, PlaneOffOriginIsExact) {
  const Quaternion tilted = turn(0.5, {0.3, 0.2, -0.4});
  const Vector3 normal = tilted * Vector3::UnitY();
  const Vector3 there(3, -5, 2);
  const Vector3 aside = tilted * Vector3(0.7, 0, -0.4);
  // Sink shapes of radius 0.5 into the plane by 0.1.
  const Vector3 centre = there + aside + 0.4 * normal;
  const Quaternion lying = tilted * shortest_rotation(Vector3::UnitY(), Vector3::UnitX());
  for (const Shape& shape : {Shape(Sphere{0.5}), Shape(Capsule{1.0, 0.5}),
                             Shape(TaperedCapsule{1.0, 0.5, 0.5}), Shape(Cylinder{1.0, 0.5, 0.5})}) {
    const auto found = contacts(shape, {centre, lying}, Plane{}, {there, tilted}, usual_margin);
    ASSERT_FALSE(found.empty()) << shape.index();
    for (const ContactPoint& point : found) {
      EXPECT_NEAR(point.distance, -0.1, 1e-12) << shape.index();
      EXPECT_NEAR(normal.dot(point.on_b - there), 0, 1e-12) << shape.index();
      EXPECT_NEAR(normal.dot(point.on_a - there), -0.1, 1e-12) << shape.index();
      EXPECT_NEAR((point.normal - normal).norm(), 0, 1e-12) << shape.index();
    }
  }
}

/// A shape that rests on another, touching it at the height 0 without a gap.
struct Resting {
  const char* name;
  Shape top;
  Pose top_pose;
  Shape bottom;
  Pose bottom_pose;
  std::size_t count;
};

std::vector<Resting> resting_cases() {
  const Polytope cube = box({1, 1, 1});
  const Polytope slab = box({20, 1, 20});
  const Pose slab_pose = {{0, -0.5, 0}, upright};
  const Polytope dodeca = dodecahedron();
  const Polytope small = scaled(dodeca, Vector3::Constant(0.01));
  const Polytope prism = cylinder(1, 0.5, 0.5);
  const Quaternion on_face = face_towards(dodeca, -Vector3::UnitY());
  const Quaternion face_up = face_towards(dodeca, Vector3::UnitY());
  const double inner = dodeca.inner_radius;
  const Quaternion on_edge = turn(pi / 4, {1, 0, 0});
  const Quaternion on_corner = shortest_rotation(Vector3(1, 1, 1), -Vector3::UnitY());
  const Quaternion lying = turn(pi / 2, {0, 0, 1});
  const Capsule capsule;
  const Polytope plate = box({1, 0.02, 1});
  const Cylinder can = make_cylinder(1, 0.5, 0.5);
  const Cylinder coin = make_cylinder(0.1, 0.3, 0.3);
  const Cylinder cone = make_cylinder(1, 0.5, 0);
  const Quaternion on_rim = turn(pi / 4, {0, 0, 1});
  // Turn the normal of the frustum's side, (cosine, sine), down.
  const Cylinder frustum = make_cylinder(1, 0.5, 0.25);
  const double slant = std::sqrt(1 + 0.0625);
  const Quaternion on_side = shortest_rotation(Vector3(1 / slant, 0.25 / slant, 0), -Vector3::UnitY());
  const double side_height = (0.5 - 0.25 * 0.5) / slant;
  // Join balls of 0.3 m and 0.1 m that are 1 m apart: the middle of the axis is 0.2 m from the side.
  const TaperedCapsule skittle = make_tapered_capsule(1, 0.3, 0.1);
  const Quaternion skittle_lying = shortest_rotation(Vector3(std::sqrt(1 - 0.04), 0.2, 0), -Vector3::UnitY());
  const TriangleMesh floor = test::flat_mesh(16, 0.5, 0);
  const Pose half_up = {{0, 0.5, 0}, upright};
  const Pose below = {{0, -0.5, 0}, upright};
  const Pose lying_below = {{0, -0.5, 0}, lying};
  const Pose across_below = {{0, -0.5, 0}, turn(pi / 2, {0, 1, 0}) * lying};
  const Pose edge_along = {{0, -std::sqrt(0.5), 0}, on_edge};
  const Pose edge_across = {{0, -std::sqrt(0.5), 0}, turn(pi / 4, {0, 0, 1})};
  const Pose can_lying = {{0, 0.5, 0}, lying};
  const Pose can_on_rim = {{0, std::sqrt(0.5), 0}, on_rim};
  const Pose capsule_lying = {{0, 0.25, 0}, lying};
  const Pose capsule_across = {{0, -0.25, 0}, turn(pi / 2, {0, 1, 0}) * lying};
  const TriangleMesh rectangle = make_rectangle(4, 4, true);
  return {
      {"box on plane", cube, {{0.3, 0.5, 0}, upright}, Plane{}, {}, 4},
      {"box on slab", cube, {{0.3, 0.5, 0.1}, upright}, slab, slab_pose, 4},
      {"box on box, the same", cube, half_up, cube, below, 4},
      {"box on box, offset", cube, {{0.5, 0.5, 0.25}, upright}, cube, below, 4},
      {"box on box, yaw", cube, {{0, 0.5, 0}, turn(pi / 4, {0, 1, 0})}, cube, below, 8},
      {"plate on plate", plate, {{0.2, 0.01, 0}, upright}, plate, {{0, -0.01, 0}, upright}, 4},
      {"box edge on slab", cube, {{0, std::sqrt(0.5), 0}, on_edge}, slab, slab_pose, 2},
      {"box corner on slab", cube, {{0, std::sqrt(0.75), 0}, on_corner}, slab, slab_pose, 1},
      {"crossed edges",
       cube,
       {{0, std::sqrt(0.5), 0}, turn(pi / 2, {0, 1, 0}) * on_edge},
       cube,
       edge_along,
       1},
      {"dodecahedron on plane", dodeca, {{0, inner, 0}, on_face}, Plane{}, {}, 5},
      {"dodecahedron on slab", dodeca, {{0.1, inner, 0}, on_face}, slab, slab_pose, 5},
      {"dodecahedron on dodecahedron",
       dodeca,
       {{0, inner, 0}, on_face},
       dodeca,
       {{0, -inner, 0}, face_up},
       5},
      {"small dodecahedron on slab", small, {{3, 0.01 * inner, 2}, on_face}, slab, slab_pose, 5},
      {"prism on slab", prism, half_up, slab, slab_pose, 32},
      {"prism on prism", prism, half_up, prism, below, 32},
      {"prism lying on slab",
       prism,
       {{0, 0.5 * std::cos(pi / 32), 0}, turn(pi / 32, {1, 0, 0}) * turn(pi / 2, {0, 0, 1})},
       slab,
       slab_pose,
       4},
      {"capsule standing on plane", capsule, half_up, Plane{}, {}, 1},
      {"capsule lying on plane", capsule, capsule_lying, Plane{}, {}, 2},
      {"capsule lying on slab", capsule, capsule_lying, slab, slab_pose, 2},
      {"capsule standing on slab", capsule, half_up, slab, slab_pose, 1},
      {"capsule lying over a box's edge", capsule, {{0.5, 0.25, 0}, lying}, cube, below, 2},
      {"capsule across a box's edge", capsule, capsule_lying, cube, edge_across, 1},
      {"capsule along a box's edge", capsule, capsule_lying, cube, edge_along, 2},
      {"capsule along capsule", capsule, {{0.1, 0.25, 0}, lying}, capsule, {{0, -0.25, 0}, lying}, 2},
      {"capsule across capsule", capsule, capsule_lying, capsule, capsule_across, 1},
      {"sphere on plane", Sphere{0.5}, half_up, Plane{}, {}, 1},
      {"sphere on slab", Sphere{0.5}, half_up, slab, slab_pose, 1},
      {"cylinder standing on plane", can, {{0.3, 0.5, 0}, upright}, Plane{}, {}, 8},
      {"cylinder standing on slab", can, {{0.3, 0.5, 0}, upright}, slab, slab_pose, 8},
      {"cylinder standing on mesh", can, {{0.25, 0.5, 0.1}, upright}, floor, {}, 8},
      {"cylinder on cylinder", can, half_up, can, below, 8},
      {"cylinder on narrow cylinder", can, half_up, coin, {{0.1, -0.05, 0}, upright}, 8},
      {"slab on cylinder", slab, half_up, can, below, 8},
      {"box on cylinder", plate, {{0, 0.01, 0}, upright}, can, below, 8},
      {"cylinder half over a box", can, {{0.5, 0.5, 0}, upright}, cube, below, 5},
      {"cylinder lying on plane", can, can_lying, Plane{}, {}, 2},
      {"cylinder lying on slab", can, can_lying, slab, slab_pose, 2},
      {"cylinder lying on mesh", can, {{0.2, 0.5, 0.1}, lying}, floor, {}, 2},
      {"cylinder lying over a box's edge", can, {{0.5, 0.5, 0}, lying}, cube, below, 2},
      {"cylinder across a box's edge", can, can_lying, cube, edge_across, 1},
      {"cylinder along a box's edge", can, can_lying, cube, edge_along, 2},
      {"cylinder along cylinder", can, {{0.1, 0.5, 0}, lying}, can, lying_below, 2},
      {"cylinder across cylinder", can, can_lying, can, across_below, 1},
      {"cylinder lying on a standing one", can, can_lying, can, below, 2},
      {"cylinder on its rim on plane", can, can_on_rim, Plane{}, {}, 1},
      {"cylinder on its rim on slab", can, can_on_rim, slab, slab_pose, 1},
      {"cylinder on its rim on a disc", can, can_on_rim, can, below, 1},
      {"cylinder on its rim on mesh", can, {{0.3, std::sqrt(0.5), 0.2}, on_rim}, floor, {}, 1},
      {"corner on a disc", cube, {{0, std::sqrt(0.75), 0}, on_corner}, can, below, 1},
      {"capsule standing on cylinder", capsule, half_up, can, below, 1},
      {"capsule lying on cylinder", capsule, capsule_lying, can, below, 2},
      {"capsule along a lying cylinder", capsule, capsule_lying, can, lying_below, 2},
      {"capsule across a lying cylinder", capsule, capsule_lying, can, across_below, 1},
      {"sphere on cylinder", Sphere{0.5}, {{0.1, 0.5, 0}, upright}, can, below, 1},
      {"sphere on a lying cylinder", Sphere{0.5}, {{0.1, 0.5, 0}, upright}, can, lying_below, 1},
      {"cone standing on plane", cone, half_up, Plane{}, {}, 8},
      {"cone standing on slab", cone, half_up, slab, slab_pose, 8},
      {"cone on its point on slab", cone, {{0, 0.5, 0}, turn(pi, {1, 0, 0})}, slab, slab_pose, 1},
      {"frustum standing on slab", frustum, half_up, slab, slab_pose, 8},
      {"frustum lying on plane", frustum, {{0, side_height, 0}, on_side}, Plane{}, {}, 2},
      {"frustum lying on slab", frustum, {{0, side_height, 0}, on_side}, slab, slab_pose, 2},
      {"frustum lying on mesh", frustum, {{0, side_height, 0.1}, on_side}, floor, {}, 2},
      {"tapered capsule lying on plane", skittle, {{0, 0.2, 0}, skittle_lying}, Plane{}, {}, 2},
      {"tapered capsule lying on slab", skittle, {{0, 0.2, 0}, skittle_lying}, slab, slab_pose, 2},
      {"tapered capsule lying on mesh", skittle, {{0, 0.2, 0.1}, skittle_lying}, floor, {}, 2},
      {"tapered capsule standing on slab", skittle, {{0, 0.8, 0}, upright}, slab, slab_pose, 1},
      {"tapered capsule standing on mesh", skittle, {{0.1, 0.8, 0.2}, upright}, floor, {}, 1},
      {"sphere on mesh", Sphere{0.5}, {{0.3, 0.5, 0.2}, upright}, floor, {}, 1},
      {"sphere on a corner of the mesh", Sphere{0.5}, half_up, floor, {}, 1},
      {"capsule lying on mesh", capsule, {{0.1, 0.25, 0.2}, lying}, floor, {}, 2},
      {"box on mesh", cube, {{0.3, 0.5, 0.1}, upright}, floor, {}, 4},
      {"turned box on mesh", cube, {{0.3, 0.5, 0.1}, turn(0.3, {0, 1, 0})}, floor, {}, 4},
      {"box edge on mesh", cube, {{0.1, std::sqrt(0.5), 0}, on_edge}, floor, {}, 2},
      {"box corner on mesh", cube, {{0.1, std::sqrt(0.75), 0.2}, on_corner}, floor, {}, 1},
      {"dodecahedron on mesh", dodeca, {{0.1, inner, 0}, on_face}, floor, {}, 5},
      {"small dodecahedron on mesh", small, {{3, 0.01 * inner, 2}, on_face}, floor, {}, 5},
      {"box on a two-sided plane", cube, {{0.3, 0.5, 0.1}, upright}, rectangle, {}, 4},
      {"box on its back", cube, {{0.3, 0.5, 0.1}, upright}, rectangle, {{0, 0, 0}, turn(pi, {1, 0, 0})}, 4},
      {"sphere on sphere", Sphere{0.5}, half_up, Sphere{1}, {{0, -1, 0}, upright}, 1},
      {"sphere on capsule", Sphere{0.5}, half_up, capsule, {{0, -0.25, 0}, lying}, 1},
  };
}

TEST(Contacts, RestingShapesHaveWholeManifold) {
  for (const Resting& rest : resting_cases()) {
    for (const double gap : {-1e-2, -1e-3, -1e-4, -1e-6, 0.0, 1e-6, 1e-4, 1e-3, 1e-2}) {
      // Skip thin solids, 2 or 3 cm thick: 1 cm deep, several directions separate them equally fast.
      const std::string name = rest.name;
      if (gap < -1e-3 && (name.starts_with("plate") || name.starts_with("small"))) continue;
      Pose pose = rest.top_pose;
      pose.position.y() += gap;
      SCOPED_TRACE(name + " at " + std::to_string(gap));
      const Contacts points = contacts(rest.top, pose, rest.bottom, rest.bottom_pose, usual_margin);
      EXPECT_EQ(complaint(points, usual_margin), "");
      EXPECT_EQ(points.size(), rest.count);
      test::expect_mirrored(points, contacts(rest.bottom, rest.bottom_pose, rest.top, pose, usual_margin));
      double worst = 0;
      for (const ContactPoint& point : points) {
        worst = std::max(worst, std::abs(point.distance - gap));
        EXPECT_LT((point.normal - Vector3::UnitY()).norm(), 1e-7);
      }
      EXPECT_LT(worst, 2e-15);  // measured 5e-16
    }
  }
}

TEST(Contacts, ReachCornersOfRestingFace) {
  const Polytope slab = box({20, 1, 20});
  for (const double angle : {0.0, 0.3, 1.0}) {
    for (const Polytope& top : {box({1, 1, 1}), dodecahedron()}) {
      const Pose pose = {{0.2, top.inner_radius - 1e-4, 0.3},
                         turn(angle, {0, 1, 0}) * face_towards(top, -Vector3::UnitY())};
      const Contacts points = contacts(top, pose, slab, {{0, -0.5, 0}, upright}, usual_margin);
      for (const Vector3& vertex : top.vertices) {
        const Vector3 corner = pose * vertex;
        const bool is_reached = std::ranges::any_of(points, [&](const ContactPoint& point) {
          const double distance = std::min((point.on_a - corner).norm(), (point.on_b - corner).norm());
          return distance < 1e-13;  // measured 3e-16
        });
        EXPECT_EQ(is_reached, corner.y() < 0);
      }
    }
  }
}

TEST(Contacts, SlightTiltKeepsFace) {
  std::mt19937 random(1);
  const Polytope cube = box({1, 1, 1});
  Polytope hull = cube;
  hull.half_box.reset();
  const Polytope dodeca = dodecahedron();
  const Quaternion on_face = face_towards(dodeca, -Vector3::UnitY());
  const Quaternion face_up = face_towards(dodeca, Vector3::UnitY());
  for (const double angle : {1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3}) {
    for (int trial = 0; trial < 300; ++trial) {
      const Quaternion tilt = turn(angle, test::random_point(random, 1));
      const double gap = trial % 2 == 0 ? -1e-4 : 1e-4;
      // Put half of the box beyond the other's edge, where an edge axis nearly separates most.
      for (const auto& [a, b] : {std::pair{&cube, &cube}, {&hull, &hull}, {&cube, &hull}}) {
        const auto points = contacts(*a, {{0.5, 1 + gap, 0}, tilt}, *b, {}, usual_margin);
        EXPECT_GE(points.size(), 4U) << angle;
        EXPECT_EQ(complaint(points, usual_margin), "");
      }
      const auto points = contacts(dodeca, {{0.3, 2 * dodeca.inner_radius + gap, 0.2}, tilt * on_face},
                                   dodeca, {{0, 0, 0}, face_up}, usual_margin);
      EXPECT_GE(points.size(), 3U) << angle;
    }
  }
}

TEST(Contacts, SlightlyTurnedBoxesHaveFourPoints) {
  const Polytope cube = box({1, 1, 1});
  const auto count = [&](double angle) {
    return contacts(cube, {{0.45, 0.999, 0}, turn(angle, {0, 1, 0})}, cube, {{0, 0, 0}, upright},
                    usual_margin)
        .size();
  };
  EXPECT_EQ(count(0), 4U);
  for (const double angle : {1e-6, 1e-4, 5e-4, 1e-3}) EXPECT_EQ(count(angle), 4U) << angle;
  EXPECT_EQ(count(0.1), 6U);  // larger cuts stay
}

TEST(Contacts, IgnorePositionOfPair) {
  // At 1 km coordinates are rounded to 1e-13 m; distances may differ by twenty times that.
  const Vector3 far(1000, -500, 700);
  const Quaternion yaw = turn(0.4, {0, 1, 0});
  for (const Resting& rest : resting_cases()) {
    if (std::holds_alternative<Plane>(rest.bottom)) continue;
    Pose top = rest.top_pose;
    top.position.y() -= 1e-4;
    const auto near_points = contacts(rest.top, top, rest.bottom, rest.bottom_pose, usual_margin);
    const Pose world = {far, yaw};
    const auto far_points =
        contacts(rest.top, world * top, rest.bottom, world * rest.bottom_pose, usual_margin);
    ASSERT_EQ(near_points.size(), far_points.size()) << rest.name;
    EXPECT_NEAR(test::lowest_distance(near_points), test::lowest_distance(far_points), 2e-12) << rest.name;
  }
}

TEST(Contacts, SpheresMatchClosedForm) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector3 a = test::random_point(random, 1);
    const Vector3 b = test::random_point(random, 1);
    const double distance = (a - b).norm() - 0.7;
    const auto points = contacts(Sphere{0.3}, {a, test::random_orientation(random)}, Sphere{0.4},
                                 {b, test::random_orientation(random)}, usual_margin);
    ASSERT_EQ(points.size(), distance < usual_margin ? 1U : 0U);
    if (points.empty()) continue;
    EXPECT_EQ(complaint(points, usual_margin), "");
    EXPECT_NEAR(points[0].distance, distance, 1e-15);
    EXPECT_LT((points[0].normal - (a - b).normalized()).norm(), 1e-15);
  }
}

TEST(Contacts, SphereAndBoxMatchClosedForm) {
  std::mt19937 random(3);
  const Vector3 half(0.5, 1, 0.25);
  const Polytope solid = box(2 * half);
  for (int trial = 0; trial < 5000; ++trial) {
    const Pose pose = {test::random_point(random, 1), test::random_orientation(random)};
    const Vector3 local = test::random_point(random, 1.5);
    const auto points = contacts(Sphere{0.3}, {pose * local, upright}, solid, pose, usual_margin);
    const Vector3 clamped = local.cwiseMax(-half).cwiseMin(half);
    double distance = (local - clamped).norm();
    if (distance == 0) distance = (local.cwiseAbs() - half).maxCoeff();
    ASSERT_EQ(points.size(), distance - 0.3 < usual_margin ? 1U : 0U);
    if (points.empty()) continue;
    EXPECT_EQ(complaint(points, usual_margin), "");
    EXPECT_NEAR(points[0].distance, distance - 0.3, 1e-14);  // measured 2e-15
  }
}

TEST(Contacts, CapsuleLeavesBoxByNearestFace) {
  const Polytope solid = box({2, 2, 2});
  const Capsule capsule = {2, 0.1};
  // Put the capsule upright through the box, 0.3 from its +X side.
  const auto points = contacts(capsule, {{0.7, 0.1, 0}, upright}, solid, {}, usual_margin);
  ASSERT_EQ(points.size(), 2U);
  for (const ContactPoint& point : points) {
    EXPECT_LT((point.normal - Vector3::UnitX()).norm(), 1e-15);
    EXPECT_NEAR(point.distance, -0.4, 1e-15);
  }
  // Put its axis 0.05 inside the +X side, aslant across the upper edges.
  const Quaternion slant = turn(pi / 4, {0, 0, 1});
  const auto edge =
      contacts(capsule, {{0.95, 0.95, 0}, turn(pi / 2, {0, 1, 0}) * turn(pi / 2, {0, 0, 1}) * slant}, solid,
               {}, usual_margin);
  EXPECT_EQ(complaint(edge, usual_margin), "");
  EXPECT_FALSE(edge.empty());
}

TEST(Contacts, CoincidentShapesHaveFinitePoints) {
  const Polytope cube = box({1, 1, 1});
  const Polytope dodeca = dodecahedron();
  const std::vector<Shape> shapes = {Sphere{}, Capsule{}, cube, dodeca};
  for (const Shape& a : shapes) {
    for (const Shape& b : shapes) {
      const auto points = contacts(a, {}, b, {}, usual_margin);
      EXPECT_FALSE(points.empty());
      EXPECT_EQ(complaint(points, usual_margin), "");
      EXPECT_LT(test::lowest_distance(points), -0.1);
    }
  }
}

TEST(Contacts, CornersTouchAtClosestPoints) {
  // The spike's point is beside the box's upper edge and above it; all its edges lead away.
  const std::vector<Vector3> corners{
      {0, 0, 0}, {0.1, 1, 0.1}, {-0.1, 1, 0.1}, {0.1, 1, -0.1}, {-0.1, 1, -0.1}};
  const Polytope spike = convex_hull(corners, "spike");
  Polytope hull = box({1, 1, 1});
  hull.half_box.reset();
  for (const Polytope& cube : {box({1, 1, 1}), hull}) {
    // Put boxes diagonally apart: each axis has a gap below the margin, the distance is √3 times it, and no
    // faces overlap.
    const auto points = contacts(cube, {Vector3::Constant(1.01), upright}, cube, {}, usual_margin);
    ASSERT_EQ(points.size(), 1U);
    EXPECT_NEAR(points[0].distance, std::sqrt(3) * 0.01, 1e-15);
    EXPECT_LT((points[0].normal - Vector3(1, 1, 1).normalized()).norm(), 1e-12);
    EXPECT_TRUE(contacts(cube, {Vector3::Constant(1.0116), upright}, cube, {}, usual_margin).empty());
    // Put the box diagonally beside an edge: the edges are nearest.
    const auto beside = contacts(cube, {{1.005, 1.005, 0}, upright}, cube, {}, usual_margin);
    ASSERT_FALSE(beside.empty());
    for (const ContactPoint& point : beside) {
      EXPECT_NEAR(point.distance, std::sqrt(2) * 0.005, 1e-15);
    }
    const auto of_spike = contacts(spike, {{0.505, 0.508, 0.1}, upright}, cube, {}, usual_margin);
    ASSERT_EQ(of_spike.size(), 1U);
    EXPECT_NEAR(of_spike[0].distance, std::hypot(0.005, 0.008), 1e-15);    // measured 9e-18
    EXPECT_LT((of_spike[0].on_b - Vector3(0.5, 0.5, 0.1)).norm(), 1e-14);  // measured 3e-17
  }
}

TEST(Contacts, EllipsoidMatchesManyPoints) {
  const Vector3 half_axes(0.2, 0.02, 0.03);
  // Make a hull of so many points that it is nearly the ellipsoid.
  Polytope points = ellipsoid(half_axes, 100);
  points.ellipsoid.reset();
  const Shape fine = points;
  const Shape smooth = ellipsoid(half_axes);
  const Pose plane{Vector3(0.1, -0.2, 0.3), turn(0.4, {1, 0.2, -0.5})};
  const Vector3 normal = plane.orientation * Vector3::UnitY();
  for (int i = 0; i < 50; ++i) {
    const Quaternion orientation = turn(0.37 * i, {std::sin(1.0 * i), 0.3, std::cos(2.0 * i)});
    const Bounds around = bounds(smooth, {Vector3::Zero(), orientation});
    const Bounds around_points = bounds(fine, {Vector3::Zero(), orientation});
    EXPECT_LT((around.max() - around_points.max()).norm(), 5e-5);  // measured 3.7e-5
    EXPECT_EQ(around.min(), -around.max());

    const Pose pose{plane.position + 0.03 * normal, orientation};
    const auto found = contacts(smooth, pose, Plane{}, plane, 1);
    const auto expected = contacts(fine, pose, Plane{}, plane, 1);
    ASSERT_EQ(found.size(), 1U);
    const auto lowest = std::ranges::min_element(expected, {}, &ContactPoint::distance);
    EXPECT_NEAR(found[0].distance, lowest->distance, 4e-5);  // measured 2.8e-5
    EXPECT_LE(found[0].distance, lowest->distance);
    EXPECT_EQ(found[0].normal, normal);
    EXPECT_NEAR(normal.dot(found[0].on_b - plane.position), 0, 1e-15);
    EXPECT_NEAR(normal.dot(found[0].on_a - found[0].on_b), found[0].distance, 1e-15);
    const Vector3 local = pose.inverse() * found[0].on_a;
    EXPECT_NEAR(local.cwiseQuotient(half_axes).norm(), 1, 1e-14);
  }
}

TEST(FindContacts, AppendsToEarlierPoints) {
  Contacts points(3);
  find_contacts(Sphere{}, {{0, 0.5, 0}, upright}, Plane{}, {}, usual_margin, points);
  EXPECT_EQ(points.size(), 4U);
  find_contacts(Plane{}, {}, Plane{}, {{0, 1, 0}, turn(1, {1, 0, 0})}, usual_margin, points);
  EXPECT_EQ(points.size(), 4U);  // planes do not touch each other
}

TEST(Contacts, RotatedBoxMatchesItsHull) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 500; ++trial) {
    const Pose placement = {test::random_point(random, 0.3), test::random_orientation(random)};
    const Polytope one = box({1, 0.8, 0.6});
    Polytope other = one;
    other.half_box.reset();
    const Pose pose = {test::random_point(random, 0.7), test::random_orientation(random)};
    const auto quick = contacts(one, pose * placement, one, placement, usual_margin);
    const auto slow = contacts(other, pose * placement, other, placement, usual_margin);
    // Equal axes give equal depths, except for ties in the choice of a face.
    ASSERT_EQ(quick.empty(), slow.empty());
    if (!quick.empty()) {
      EXPECT_NEAR(test::lowest_distance(quick), test::lowest_distance(slow), 1e-12);
    }
  }
}

TEST(Bounds, AreTight) {
  std::mt19937 random(7);
  const std::vector<Polytope> polytopes = {
      box({1, 2, 3}), dodecahedron(), cylinder(1, 0.5, 0.2),
      test::transformed(box({1, 2, 3}), {{1, 2, 3}, turn(1, {1, 1, 0})})};
  for (const Polytope& polytope : polytopes) {
    const Pose pose = {test::random_point(random, 10), test::random_orientation(random)};
    const Bounds found = bounds(polytope, pose);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 unit = Vector3::Unit(axis);
      EXPECT_NEAR(found.max()[axis], test::extent(polytope, pose, unit), 1e-14);  // measured 4e-15
      EXPECT_NEAR(found.min()[axis], -test::extent(polytope, pose, -unit), 1e-14);
    }
  }
  const Bounds ball = bounds(Sphere{2}, {{1, 2, 3}, upright});
  EXPECT_EQ(ball.min(), Vector3(-1, 0, 1));
  EXPECT_EQ(ball.max(), Vector3(3, 4, 5));
  const Bounds capsule = bounds(Capsule{1, 0.5}, {{0, 0, 0}, turn(pi / 4, {0, 0, 1})});
  EXPECT_NEAR(capsule.max().x(), std::sqrt(0.5) + 0.5, 1e-15);
  EXPECT_NEAR(capsule.max().z(), 0.5, 1e-15);
}

TEST(Bounds, PlanesEndWhereTheyFaceAnAxis) {
  const Bounds floor = bounds(Plane{}, {{1, 2, 3}, upright});
  EXPECT_EQ(floor.max(), Vector3(infinity, 2, infinity));
  EXPECT_EQ(floor.min(), Vector3::Constant(-infinity));
  // A quarter turn: the normal is −X, so the half-space lies above x = 1.
  const Bounds wall = bounds(Plane{}, {{1, 2, 3}, turn(pi / 2, {0, 0, 1})});
  EXPECT_EQ(wall.min(), Vector3(1, -infinity, -infinity));
  EXPECT_EQ(wall.max(), Vector3::Constant(infinity));
  const Bounds ramp = bounds(Plane{}, {{1, 2, 3}, turn(0.1, {0, 0, 1})});
  EXPECT_EQ(ramp.max(), Vector3::Constant(infinity));
}

}  // namespace
}  // namespace substep
