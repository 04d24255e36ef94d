#pragma once
/// Collision shapes and mass properties of bodies from files.

#include <optional>
#include <span>
#include <string>

#include "sim/geometry/mass_properties.h"
#include "sim/geometry/shape.h"
#include "sim/loading/json_value.h"
#include "sim/loading/physics_extension.h"

namespace substep {

/// Density of bodies without mass and density, that of water, kg/m³.
inline constexpr double default_density = 1000;

/// Returns the collision shape of an implicit shape on a node with this scale, whose signs do not count.
/// `place` is the collider, for messages. A sphere or capsule under a scale that differs along its axes
/// becomes the hull of points on it, a capsule with a warning; `faceted` keeps that hull, unscaled.
/// A finite or two-sided plane becomes a triangle mesh. Throws Error where the scale leaves no volume.
Shape implicit_shape(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& faceted,
                     const JsonValue& place);

/// A convex hull of points; with too many vertices, that of the outermost points in evenly spread directions.
struct SimplifiedHull {
  Polytope hull;
  std::string warning;  ///< names the largest distance left out; empty for an exact hull
};

/// Returns the hull. Messages begin with `what`. Throws Error where there is no volume.
SimplifiedHull simplified_hull(std::span<const Vector3> points, const std::string& what);

/// Smallest fraction of its hull's volume that makes an enclosed solid one to compute with.
inline constexpr double least_filled = 1e-6;
/// Returns the largest such fraction, which rounding and simplified hulls take above 1. A mesh with a larger
/// one cuts through itself.
inline double most_filled(const SimplifiedHull& hull) {
  return hull.warning.empty() ? 1.001 : 1.1;
}

/// Returns the mass properties, at unit density, of the solid that triangles enclose, also where they are
/// inside out; nothing where they are not closed, and mass 0 where a connected part alone faces inwards.
std::optional<MassProperties> enclosed_solid(std::span<const Vector3> points,
                                             std::span<const Triangle> triangles);

/// Returns principal_inertia() without rounding: makes moments equal that differ by rounding alone, so that
/// symmetric bodies have no gyroscopic term, and products of that size 0, so that axes stay the shape's.
PrincipalInertia symmetric_principal_inertia(Matrix3 inertia);

}  // namespace substep
