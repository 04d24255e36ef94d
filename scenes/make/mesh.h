#pragma once
/// Models the scenes' meshes: solids with rounded edges and smooth normals, in metres. No function calls libm
/// beyond sqrt, so that every machine writes the same bytes.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/math/vector.h"

namespace substep::scenes {

/// Triangles counter-clockwise seen from outside; one unit normal per position, or none for flat faces.
struct Mesh {
  std::vector<Vector3> positions;
  std::vector<Vector3> normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Adds the triangles of `other`. Both have normals, or neither, unless one is empty.
  Mesh& operator+=(const Mesh& other);
};

inline Mesh operator+(Mesh first, const Mesh& second) {
  first += second;
  return first;
}

/// Returns the mesh at a pose.
Mesh operator*(const Pose& pose, Mesh mesh);

/// A convex solid: planar polygons, counter-clockwise seen from outside, three of them at each vertex.
struct Polyhedron {
  std::vector<Vector3> vertices;
  std::vector<std::vector<int>> faces;
};

/// Returns a box with full extents `size`, centred at the origin.
Polyhedron box(const Vector3& size);

/// A point of an outline in a plane.
struct PlanePoint {
  double u;
  double v;
};
using Outline = std::vector<PlanePoint>;

inline PlanePoint point(double u, double v) {
  return {u, v};
}

/// Returns a prism along +Y, from −height/2 to height/2. The outline's u and v are x and −z:
/// counter-clockwise on paper is counter-clockwise seen from above. The top is the outline times `top_scale`.
Polyhedron prism(const Outline& outline, double height, double top_scale = 1);

/// Returns the solid with each edge and corner rounded by a rolling ball of `radius`, in `segments` steps.
/// Faces keep their planes. `radius` must leave a part of each face.
Mesh rounded(const Polyhedron& solid, double radius, int segments = 3);

/// Returns a box with rounded edges.
inline Mesh cuboid(const Vector3& size, double radius, int segments = 3) {
  return rounded(box(size), radius, segments);
}

/// Returns the solid's mesh with flat faces and sharp edges.
Mesh faceted(const Polyhedron& solid);

/// A corner of a turned solid's outline: its distance from the axis and its height, m.
struct ProfilePoint {
  double radius;
  double y;
  double fillet = 0;  ///< radius of the rounded corner, m; 0: sharp
};
using Profile = std::vector<ProfilePoint>;

inline ProfilePoint corner(double radius, double y, double fillet = 0) {
  return {radius, y, fillet};
}

/// Returns the solid of revolution about +Y of a profile from the bottom up, with the solid on the profile's
/// left if radius is drawn to the right. `closed`: the last point joins the first; else both are on the axis.
Mesh turned(const Profile& profile, int sides, bool closed = false);

/// Returns a ball about the origin.
Mesh ball(double radius, int sides = 32);

/// Returns a cylinder along +Y, centred at the origin, its rims rounded by `fillet`.
Mesh rod(double length, double radius, double fillet, int sides = 24);

/// Returns a ring of a rectangular section, its edges rounded by `fillet`.
Mesh ring(double inner, double outer, double half_height, double fillet, int sides);

/// Returns the convex hull of points, with flat faces.
Mesh hull(std::span<const Vector3> points);

/// Returns a pseudo-random number in [0, 1) for each `index`, the same on every machine.
double noise(std::uint64_t index);

/// Returns the rotation by `angle` about an axis through the origin.
Pose turn(const Vector3& axis, double angle);

/// Returns the pose at a point, without rotation.
Pose at(double x, double y, double z);
Pose at(const Vector3& point);

}  // namespace substep::scenes
