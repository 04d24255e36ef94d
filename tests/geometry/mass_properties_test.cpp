#include "sim/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/round_shapes.h"
#include "tests/geometry/solids.h"

namespace substep {
namespace {

struct Mesh {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
};

/// Returns the faces of a polytope as triangles, each with vertices of its own, as a mesh with flat shading
/// has them.
Mesh mesh_of(const Polytope& polytope, const Vector3& offset) {
  Mesh mesh;
  for (const Triangle& triangle : test::triangles_of(polytope)) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const std::uint32_t corner : triangle) mesh.vertices.push_back(polytope.vertices[corner] + offset);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

Vector3 box_inertia(double mass, const Vector3& size) {
  const Vector3 squares = size.cwiseProduct(size);
  return mass / 12 * Vector3(squares.y() + squares.z(), squares.z() + squares.x(), squares.x() + squares.y());
}

TEST(MassProperties, BoxMeshIsExactNearAndFar) {
  const Vector3 size(1, 2, 3);
  for (const double far : {0.0, 10.0, 1e6}) {
    const Vector3 offset(far, -far, far / 2);
    const Mesh mesh = mesh_of(box(size), offset);
    const MassProperties properties = mass_properties(mesh.vertices, mesh.triangles);
    EXPECT_NEAR(properties.mass, 6, 1e-14);  // measured 0
    EXPECT_LT((properties.centre_of_mass - offset).norm(),
              1e-15 + 1e-16 * far);  // measured 2e-16, 0
    const Matrix3 expected = box_inertia(6, size).asDiagonal();
    EXPECT_LT((properties.inertia - expected).norm(), 1e-13) << far;  // measured 4e-15
  }
}

TEST(MassProperties, InvertedMeshIsNegative) {
  Mesh mesh = mesh_of(box({1, 2, 3}), {5, 5, 5});
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NEAR(mass_properties(mesh.vertices, mesh.triangles).mass, -6, 1e-14);
  EXPECT_TRUE(is_closed(mesh.vertices, mesh.triangles));
}

TEST(MassProperties, EmptyMeshAndPlaneHaveNoMass) {
  EXPECT_EQ(mass_properties({}, {}).mass, 0);
  EXPECT_EQ(mass_properties(Shape(Plane{})).mass, 0);
}

TEST(IsClosed, WeldsPositionsFirst) {
  Mesh mesh = mesh_of(box({1, 2, 3}), {0, 0, 0});
  EXPECT_EQ(mesh.vertices.size(), 36U);
  EXPECT_TRUE(is_closed(mesh.vertices, mesh.triangles));
  Mesh open = mesh;
  open.triangles.pop_back();
  EXPECT_FALSE(is_closed(open.vertices, open.triangles));
  Mesh turned = mesh;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_FALSE(is_closed(turned.vertices, turned.triangles));
  Mesh twice = mesh;
  twice.triangles.insert(twice.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  EXPECT_FALSE(is_closed(twice.vertices, twice.triangles));
  Mesh moved = mesh;
  moved.vertices[0].x() += 1e-9;
  EXPECT_FALSE(is_closed(moved.vertices, moved.triangles));
  Mesh bad = mesh;
  bad.vertices[0].x() = std::nan("");
  EXPECT_FALSE(is_closed(bad.vertices, bad.triangles));
  bad = mesh;
  bad.triangles[0][0] = 36;
  EXPECT_FALSE(is_closed(bad.vertices, bad.triangles));
  EXPECT_FALSE(is_closed({}, {}));
  // A triangle whose corners are welded to a line changes nothing.
  mesh.triangles.push_back({0, 0, 1});
  EXPECT_TRUE(is_closed(mesh.vertices, mesh.triangles));
}

TEST(MassProperties, SphereMatchesClosedForm) {
  const MassProperties ball = mass_properties(Shape(Sphere{2}));
  EXPECT_DOUBLE_EQ(ball.mass, 32 * test::pi / 3);
  EXPECT_DOUBLE_EQ(ball.inertia(0, 0), 0.4 * 32 * test::pi / 3 * 4);
}

/// Returns volume and moments of a solid of revolution about the Y axis by slices: ∫ π r² dy and the moments
/// of the discs.
template <class SquaredRadius>
MassProperties sliced(double low, double high, SquaredRadius squared_radius) {
  constexpr int slices = 200000;
  const double step = (high - low) / slices;
  double mass = 0;
  double first = 0;
  double along = 0;
  double across = 0;
  for (int i = 0; i < slices; ++i) {
    const double y = low + (i + 0.5) * step;
    const double squared = squared_radius(y);
    const double slice = test::pi * squared * step;
    mass += slice;
    first += slice * y;
    along += slice * squared / 2;
    across += slice * (squared / 4 + y * y);
  }
  MassProperties result;
  result.mass = mass;
  result.centre_of_mass = {0, first / mass, 0};
  across -= first * first / mass;
  result.inertia = Vector3(across, along, across).asDiagonal();
  return result;
}

void expect_near(const MassProperties& one, const MassProperties& other, double tolerance) {
  EXPECT_NEAR(one.mass, other.mass, tolerance);
  EXPECT_LT((one.centre_of_mass - other.centre_of_mass).norm(), tolerance);
  EXPECT_LT((one.inertia - other.inertia).norm(), tolerance);
}

TEST(MassProperties, CylindersMatchTheirSlices) {
  for (const Cylinder& cylinder :
       {Cylinder{0.7, 0.4, 0.4}, {0.7, 0.4, 0.1}, {0.2, 0.5, 0}, {1, 0, 0.3}, {0.01, 0.5, 0.5}}) {
    const double h = cylinder.half_height;
    const auto squared_radius = [&](double y) {
      const double part = (y + h) / (2 * h);
      const double radius = (1 - part) * cylinder.radius_bottom + part * cylinder.radius_top;
      return radius * radius;
    };
    expect_near(mass_properties(Shape(cylinder)), sliced(-h, h, squared_radius),
                1e-10);  // measured 3e-12
  }
  // π r² h, m r²/2 and m (3 r² + h²)/12.
  const MassProperties straight = mass_properties(Shape(make_cylinder(2, 0.5, 0.5)));
  const double mass = test::pi / 2;
  EXPECT_DOUBLE_EQ(straight.mass, mass);
  EXPECT_DOUBLE_EQ(straight.inertia(1, 1), mass * 0.125);
  EXPECT_DOUBLE_EQ(straight.inertia(0, 0), mass * (0.75 + 4) / 12);
}

TEST(MassProperties, TaperedCapsulesMatchTheirSlices) {
  // One that is not tapered is a capsule.
  expect_near(mass_properties(Shape(Capsule{0.75, 0.5})),
              mass_properties(Shape(TaperedCapsule{0.75, 0.5, 0.5})), 1e-15);
  for (const TaperedCapsule& capsule : {TaperedCapsule{0.5, 0.4, 0.2},
                                        {0.75, 0.5, 0.5},
                                        {0.5, 0.1, 0.3},
                                        {0.5, 0.3, 0},
                                        {0.1, 0.5, 0.2},
                                        {0.2, 0.1, 0.6},
                                        {0, 0.3, 0.3}}) {
    const double h = capsule.half_length;
    const double bottom = capsule.radius_bottom;
    const double top = capsule.radius_top;
    // The union of all balls between the two: the largest of r(s)² − (y − c(s))² over s from 0 to 1.
    const auto squared_radius = [&](double y) {
      const auto squared = [&](double part) {
        const double centre = (2 * part - 1) * h;
        const double radius = (1 - part) * bottom + part * top;
        return radius * radius - (y - centre) * (y - centre);
      };
      // The maximum of a quadratic in `part`: its vertex or an end.
      const double slope = top - bottom;
      const double curve = slope * slope - 4 * h * h;
      double best = std::max(squared(0), squared(1));
      if (curve < 0) {
        best = std::max(best, squared(std::clamp(-(bottom * slope + 2 * h * (y + h)) / curve, 0.0, 1.0)));
      }
      return std::max(0.0, best);
    };
    const double low = std::min(-h - bottom, h - top);
    const double high = std::max(-h + bottom, h + top);
    expect_near(mass_properties(Shape(capsule)), sliced(low, high, squared_radius), 1e-9);  // measured 1e-11
  }
}

TEST(MassProperties, PolytopeMatchesItsMesh) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Polytope hull = test::random_hull(random, 30);
    const Mesh mesh = mesh_of(hull, {0, 0, 0});
    EXPECT_TRUE(is_closed(mesh.vertices, mesh.triangles));
    const MassProperties one = mass_properties(Shape(hull));
    const MassProperties other = mass_properties(mesh.vertices, mesh.triangles);
    EXPECT_NEAR(one.mass, other.mass, 1e-13 * one.mass);
    EXPECT_LT((one.inertia - other.inertia).norm(), 1e-13 * one.inertia.norm());
  }
}

TEST(MassProperties, TransformAndCombine) {
  // Two boxes side by side are one box, wherever it stands.
  const Pose pose = {{3, -1, 2}, test::turn(1.1, {1, 2, -1})};
  const MassProperties half = mass_properties(Shape(box({1, 1, 3})));
  const MassProperties left = transformed(half, {{-0.5, 0, 0}, Quaternion::Identity()});
  const MassProperties right = transformed(half, {{0.5, 0, 0}, Quaternion::Identity()});
  const MassProperties both = transformed(combined(left, right), pose);
  const MassProperties whole = mass_properties(Shape(test::transformed(box({2, 1, 3}), pose)));
  EXPECT_NEAR(both.mass, 6, 1e-14);
  EXPECT_LT((both.centre_of_mass - pose.position).norm(), 1e-14);
  EXPECT_LT((both.inertia - whole.inertia).norm(), 1e-13);  // measured 5e-15
  EXPECT_EQ(combined(both, {}).mass, both.mass);
  EXPECT_EQ(combined({}, both).inertia, both.inertia);
  const MassProperties heavy = with_mass(both, 12);
  EXPECT_EQ(heavy.mass, 12);
  EXPECT_LT((heavy.inertia - 2 * both.inertia).norm(), 1e-13);
}

Matrix3 rebuilt(const PrincipalInertia& principal) {
  const Matrix3 axes = principal.orientation.toRotationMatrix();
  return axes * principal.moments.asDiagonal() * axes.transpose();
}

TEST(PrincipalInertia, DiagonalMatrixKeepsAxes) {
  for (const Vector3& moments : {Vector3(3, 1, 2), Vector3(1, 1, 1), Vector3(5, 5, 1), Vector3(0, 0, 0)}) {
    const PrincipalInertia principal = principal_inertia(moments.asDiagonal());
    EXPECT_EQ(principal.moments, moments);
    EXPECT_EQ(principal.orientation.coeffs(), Quaternion::Identity().coeffs());
  }
}

TEST(PrincipalInertia, RotatedCubeKeepsIdentityAxes) {
  const MassProperties cube = mass_properties(
      Shape(test::transformed(box({1, 1, 1}), {Vector3::Zero(), test::turn(0.3, {1, 2, 3})})));
  EXPECT_EQ(principal_inertia(cube.inertia).orientation.coeffs(), Quaternion::Identity().coeffs());
}

TEST(PrincipalInertia, DiagonalizesRandomBodies) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector3 moments = test::random_point(random, 1).cwiseAbs() + Vector3(1, 1, 1);
    const Matrix3 axes = test::random_orientation(random).toRotationMatrix();
    const Matrix3 inertia = axes * moments.asDiagonal() * axes.transpose();
    const PrincipalInertia principal = principal_inertia(inertia);
    EXPECT_LT((rebuilt(principal) - inertia).norm(), 1e-13);  // measured 2.6e-14
    EXPECT_NEAR(principal.orientation.norm(), 1, 1e-15);
    // The nearest of the 24 ways to name the axes turns by 62.8° at most.
    EXPECT_GE(std::abs(principal.orientation.w()), std::cos(31.4 / 180 * test::pi) - 1e-4);
  }
}

TEST(MassProperties, EllipsoidMatchesManyFacets) {
  const Vector3 half_axes(0.2, 0.02, 0.03);
  Polytope facets = ellipsoid(half_axes, 60);
  facets.ellipsoid.reset();
  const MassProperties expected = mass_properties(facets);
  const MassProperties found = mass_properties(ellipsoid(half_axes));
  EXPECT_NEAR(expected.mass / found.mass, 1,
              1.5e-3);  // measured 1.1e-3: the hull lies inside
  EXPECT_LT((expected.inertia - found.inertia).norm(),
            2.5e-3 * found.inertia.norm());  // measured 2.1e-3
}

TEST(PrincipalInertia, FollowsSmallTurn) {
  const Vector3 moments(3, 1, 2);
  const Quaternion small = test::turn(0.1, {1, 2, 3});
  const Matrix3 axes = small.toRotationMatrix();
  const PrincipalInertia principal = principal_inertia(axes * moments.asDiagonal() * axes.transpose());
  EXPECT_LT((principal.moments - moments).norm(), 1e-14);
  EXPECT_NEAR(std::abs(principal.orientation.dot(small)), 1, 1e-14);
}

TEST(PrincipalInertia, HandlesEqualAndDisparateMoments) {
  for (const Vector3& moments : {Vector3(1, 1 + 1e-12, 1), Vector3(1e-9, 1, 1), Vector3(1e9, 1, 1e-3)}) {
    const Matrix3 axes = test::turn(0.8, {3, 1, 2}).toRotationMatrix();
    const Matrix3 inertia = axes * moments.asDiagonal() * axes.transpose();
    EXPECT_LT((rebuilt(principal_inertia(inertia)) - inertia).norm(), 1e-13 * inertia.norm());
  }
}

}  // namespace
}  // namespace substep
