#pragma once
/// Solids and poses for the geometry tests.

#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/shape.h"

namespace substep::test {

using std::numbers::pi;
constexpr double usual_margin = 0.02;  ///< m: contacts are found up to this distance
const Quaternion upright = Quaternion::Identity();

/// Returns the vertices (±1, ±1, ±1), (0, ±1/φ, ±φ), … of a regular dodecahedron with edges of length 2/φ.
std::vector<Vector3> dodecahedron_points();

Polytope dodecahedron();

/// Returns the hull of `count` points, each coordinate normally distributed.
Polytope random_hull(std::mt19937& random, int count);

/// Returns balls, capsules, cylinders, cones and tapered capsules, up to 2 m long.
std::vector<Shape> round_shapes();

/// Returns the polytope moved rigidly, as a hull: vertex → pose * vertex.
Polytope transformed(const Polytope& polytope, const Pose& pose);

/// Returns the i-th of side³ points with whole coordinates from 0.
Vector3 grid_point(int i, int side);

Quaternion random_orientation(std::mt19937& random);

/// Returns a point that is uniform in [-reach, reach]³.
Vector3 random_point(std::mt19937& random, double reach);

/// Returns the rotation by `angle` about `axis`, computed with libm and not with the project's own sine.
Quaternion turn(double angle, const Vector3& axis);

/// Returns the number of random pairs to compare with an oracle: `usual`, or the value of
/// SUBSTEP_ORACLE_PAIRS.
int oracle_pairs(int usual);

/// Returns a square of side × side cells in the plane y = 0 about the origin, each of two triangles. `uneven`
/// shifts inner corners in the plane by up to that fraction of a cell and flips diagonals at random.
TriangleMesh flat_mesh(int side, double cell, double uneven);

/// Returns the faces of a polytope as triangles.
std::vector<Triangle> triangles_of(const Polytope& polytope);

Contacts contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin);

double lowest_distance(const Contacts& points);

/// Returns which law of contacts is violated; empty: none. Contacts are finite and have unit normals. Their
/// distance is below the margin and equals that of their two points.
std::string complaint(const Contacts& points, double margin);

/// Expects the contacts of (b, a) to be those of (a, b) with a and b exchanged.
void expect_mirrored(const Contacts& one, const Contacts& other);

/// Returns the extent of a convex shape along a unit direction, by definition.
double extent(const Shape& shape, const Pose& pose, const Vector3& direction);

/// Returns the separation of two polytopes by testing every face and every pair of edges, with no short cuts.
double brute_separation(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b);

}  // namespace substep::test
