#pragma once
/// Mass, centre of mass and inertia of solids of uniform density.

#include <span>

#include "sim/geometry/shape.h"

namespace substep {

/// Mass properties in some frame. `inertia` is about `centre_of_mass`, in the axes of that frame, kg·m².
struct MassProperties {
  double mass = 0;  ///< kg
  Vector3 centre_of_mass = Vector3::Zero();
  Matrix3 inertia = Matrix3::Zero();
};

/// Principal axes: inertia = R diag(moments) Rᵀ with R the matrix of `orientation` (principal → given frame).
struct PrincipalInertia {
  Vector3 moments = Vector3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

/// Returns the mass properties of a solid of unit density bounded by a closed triangle mesh,
/// counter-clockwise seen from outside, by signed tetrahedra about the mean vertex. An inverted mesh gives a
/// negative mass.
MassProperties mass_properties(std::span<const Vector3> vertices, std::span<const Triangle> triangles);

/// Returns the mass properties of a shape of unit density, in its collider's frame. Planes and triangle
/// meshes have mass 0.
MassProperties mass_properties(const Shape& shape);

/// Returns true where each directed edge occurs once and its reverse once, after vertices at equal positions
/// are welded.
bool is_closed(std::span<const Vector3> vertices, std::span<const Triangle> triangles);

/// Returns `properties`' values in a frame in which the frame of theirs has the pose `pose`.
MassProperties transformed(const MassProperties& properties, const Pose& pose);

/// Returns the properties of two bodies as one, in their common frame.
MassProperties combined(const MassProperties& a, const MassProperties& b);

/// Returns the properties scaled to the mass `mass`.
MassProperties with_mass(const MassProperties& properties, double mass);

/// Returns the principal axes of a symmetric matrix by Jacobi rotations; the identity for a diagonal matrix.
PrincipalInertia principal_inertia(const Matrix3& inertia);

}  // namespace substep
