#pragma once
/// Collision shapes from what a glTF file describes, with the node's scale worked into them.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/geometry/shape.h"
#include "sim/loading/json_value.h"
#include "sim/loading/physics_extension.h"

namespace substep {

/// Returns the collision shape of an implicit shape on a node with this scale, whose signs do not count.
/// `place` is the collider, for messages. A sphere or capsule under a scale that differs along its axes
/// becomes the hull of points on it, with a warning; `faceted` keeps that hull, unscaled, for the next scale.
/// A finite or two-sided plane becomes a triangle mesh. Throws Error where the scale leaves no volume.
Shape implicit_shape(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& faceted,
                     const JsonValue& place, std::vector<std::string>& warnings);

/// A convex hull of points; where it would have too many vertices, the hull of the outermost points in evenly
/// spread directions.
struct SimplifiedHull {
  Polytope hull;
  std::string warning;  ///< how much it leaves out; empty where it is the hull
};

/// Returns the hull. Messages begin with `what`. Throws Error where there is no volume.
SimplifiedHull simplified_hull(std::span<const Vector3> points, const std::string& what);

}  // namespace substep
