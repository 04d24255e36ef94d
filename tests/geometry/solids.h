#pragma once
/// Solids and poses for the geometry tests.

#include <random>
#include <string>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/shape.h"

namespace substep::test {

/// Returns the vertices (±1, ±1, ±1), (0, ±1/φ, ±φ), … of a regular dodecahedron with edges of length 2/φ.
std::vector<Vector3> dodecahedron_points();

/// The hull of `count` points, each coordinate normally distributed.
Polytope random_hull(std::mt19937& random, int count);

/// Returns the i-th of side³ points with whole coordinates from 0.
Vector3 grid_point(int i, int side);

Quaternion random_orientation(std::mt19937& random);

/// Returns a point that is uniform in [-reach, reach]³.
Vector3 random_point(std::mt19937& random, double reach);

/// A rotation by `angle` about `axis`, through libm: tests only.
Quaternion turn(double angle, const Vector3& axis);

/// Returns the number of random pairs to compare with an oracle: `usual`, or the value of
/// SUBSTEP_ORACLE_PAIRS.
int oracle_pairs(int usual);

/// A square of side × side cells in the plane y = 0 about the origin, each of two triangles. `uneven` shifts
/// inner corners in the plane by up to that part of a cell and turns the diagonals at random.
TriangleMesh flat_mesh(int side, double cell, double uneven);

std::vector<ContactPoint> contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                                   double margin);

double lowest_distance(const std::vector<ContactPoint>& points);

/// Returns which law of contacts is violated; empty: none. Contacts are finite, with unit normals and a
/// distance below the margin that is that of their two points.
std::string complaint(const std::vector<ContactPoint>& points, double margin);

/// The separation of two polytopes by testing every face and every pair of edges, with no short cuts.
double brute_separation(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b);

}  // namespace substep::test
