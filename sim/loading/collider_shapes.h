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

/// The shape of an implicit shape on a node with this scale; only its size counts, not its signs. `place` is
/// the collider, named in complaints. A sphere or capsule under a scale that differs along its axes becomes
/// the hull of points on it, with a warning; `faceted` keeps that hull, unscaled, for the next scale. A
/// finite or two-sided plane becomes a triangle mesh. Throws Error where the scale leaves no volume.
Shape implicit_shape(const ImplicitShape& shape, const Vector3& scale, std::optional<Polytope>& faceted,
                     const JsonValue& place, std::vector<std::string>& warnings);

/// The convex hull of points or, where that has more vertices than a contact can afford, that of the
/// outermost points in evenly spread directions.
struct SimplifiedHull {
  Polytope hull;
  std::string warning;  ///< how much it leaves out; empty where it is the hull
};

/// `what` is at the front of complaints. Throws Error where there is no volume.
SimplifiedHull simplified_hull(std::span<const Vector3> points, const std::string& what);

}  // namespace substep
