#include "sim/geometry/contact.h"

#include <algorithm>
#include <array>

#include "sim/geometry/contact_pairs.h"

namespace substep {
namespace {

/// Turns contacts of (a, b) into those of (b, a), from index `first` on.
void mirror(Contacts& out, std::size_t first) {
  for (std::size_t i = first; i < out.size(); ++i) {
    std::swap(out[i].on_a, out[i].on_b);
    out[i].normal = -out[i].normal;
  }
}

Capsule as_capsule(const Shape& sphere_or_capsule) {
  if (const auto* capsule = std::get_if<Capsule>(&sphere_or_capsule)) return *capsule;
  return {0, std::get<Sphere>(sphere_or_capsule).radius};
}

/// Finds contacts of shapes whose kinds are in the order of their indices in Shape: a's kind is not after
/// b's.
void find_ordered(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin,
                  Contacts& out) {
  const bool a_is_plane = std::holds_alternative<Plane>(a);
  const auto* const polytope_a = std::get_if<Polytope>(&a);
  if (const auto* mesh = std::get_if<TriangleMesh>(&b)) {
    // Planes and meshes never move.
    if (!a_is_plane && !std::holds_alternative<TriangleMesh>(a)) {
      find_shape_mesh(a, pose_a, *mesh, pose_b, margin, out);
    }
  } else if (std::holds_alternative<Cylinder>(b) || std::holds_alternative<TaperedCapsule>(b)) {
    const RevolvedSolid solid = *as_revolved(b, pose_b);
    const std::size_t first = out.size();
    if (a_is_plane) {
      find_revolved_plane(solid, pose_a, margin, out);
    } else if (polytope_a) {
      find_round_polytope(b, pose_b, *polytope_a, pose_a, margin, out);
    } else {
      find_revolved_revolved(*as_revolved(a, pose_a), solid, margin, out);
      return;
    }
    mirror(out, first);
  } else if (const auto* polytope = std::get_if<Polytope>(&b)) {
    if (polytope_a && polytope_a->half_box && polytope->half_box) {
      find_box_box(*polytope_a, pose_a, *polytope, pose_b, margin, out);
    } else if (polytope_a) {
      find_polytope_polytope(*polytope_a, pose_a, *polytope, pose_b, margin, out);
    } else if (a_is_plane) {
      find_plane_polytope(pose_a, *polytope, pose_b, margin, out);
    } else {
      find_capsule_polytope(as_capsule(a), pose_a, *polytope, pose_b, margin, out);
    }
  } else if (std::holds_alternative<Plane>(b)) {
    if (!a_is_plane) find_capsule_plane(as_capsule(a), pose_a, pose_b, margin, out);
  } else {
    find_capsule_capsule(as_capsule(a), pose_a, as_capsule(b), pose_b, margin, out);
  }
}

std::array<double, 7> numbers(const Pose& pose) {
  const Vector3& p = pose.position;
  const Quaternion& q = pose.orientation;
  return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
}

/// Returns true where the pair is evaluated as (b, a). The rule ignores which of the two is named first, so
/// that contacts(b, a) mirror contacts(a, b) where the search prefers one side.
bool is_reversed(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
  if (a.index() != b.index()) return a.index() > b.index();
  return numbers(pose_a) > numbers(pose_b);
}

Bounds around(const Vector3& centre, const Vector3& half_size) {
  return {centre - half_size, centre + half_size};
}

Bounds bounds_of(const Sphere& sphere, const Pose& pose) {
  return around(pose.position, Vector3::Constant(sphere.radius));
}

Bounds bounds_of(const Plane& /*plane*/, const Pose& pose) {
  Bounds result{Vector3::Constant(-infinity), Vector3::Constant(infinity)};
  const Vector3 normal = pose.orientation * Vector3::UnitY();
  for (int axis = 0; axis < 3; ++axis) {
    // A quarter turn leaves this much of the other axes by rounding.
    if ((normal - normal[axis] * Vector3::Unit(axis)).cwiseAbs().maxCoeff() > 1e-15) continue;
    (normal[axis] > 0 ? result.max() : result.min())[axis] = pose.position[axis];
  }
  return result;
}

Bounds bounds_of(const Polytope& polytope, const Pose& pose) {
  const Matrix3 rotation = pose.orientation.toRotationMatrix();
  if (polytope.half_box) return around(pose.position, rotation.cwiseAbs() * *polytope.half_box);
  if (polytope.ellipsoid)
    return around(pose.position, (rotation * polytope.ellipsoid->asDiagonal()).rowwise().norm());
  Bounds result(Vector3(rotation * polytope.vertices.front()));
  for (const Vector3& vertex : polytope.vertices) result.extend(rotation * vertex);
  return result.translate(pose.position);
}

/// Returns the bounds of two balls, or of two discs across the axis, around ∓half along the axis.
Bounds bounds_of_ends(const Pose& pose, const Vector3& half, const Vector3& reach_bottom,
                      const Vector3& reach_top) {
  return {pose.position + (-half - reach_bottom).cwiseMin(half - reach_top),
          pose.position + (-half + reach_bottom).cwiseMax(half + reach_top)};
}

Bounds bounds_of(const Cylinder& cylinder, const Pose& pose) {
  const Vector3 axis = pose.orientation * Vector3::UnitY();
  // Extents along the world's axes of a disc of radius 1 across the shape's axis.
  const Vector3 reach = (Vector3::Ones() - axis.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  return bounds_of_ends(pose, cylinder.half_height * axis, cylinder.radius_bottom * reach,
                        cylinder.radius_top * reach);
}

Bounds bounds_of(const TaperedCapsule& capsule, const Pose& pose) {
  return bounds_of_ends(pose, pose.orientation * Vector3(0, capsule.half_length, 0),
                        Vector3::Constant(capsule.radius_bottom), Vector3::Constant(capsule.radius_top));
}

Bounds bounds_of(const Capsule& capsule, const Pose& pose) {
  return bounds_of(TaperedCapsule{capsule.half_length, capsule.radius, capsule.radius}, pose);
}

Bounds bounds_of(const TriangleMesh& mesh, const Pose& pose) {
  const Bounds& own = mesh.nodes[0].bounds;
  const Vector3 half = own.sizes() / 2;
  const Matrix3 rotation = pose.orientation.toRotationMatrix();
  return around(pose.position + rotation * (own.min() + half), rotation.cwiseAbs() * half);
}

}  // namespace

void find_contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b, double margin,
                   Contacts& out) {
  if (!is_reversed(a, pose_a, b, pose_b)) {
    find_ordered(a, pose_a, b, pose_b, margin, out);
    return;
  }
  const std::size_t first = out.size();
  find_ordered(b, pose_b, a, pose_a, margin, out);
  mirror(out, first);
}

Bounds bounds(const Shape& shape, const Pose& pose) {
  return std::visit([&](const auto& solid) { return bounds_of(solid, pose); }, shape);
}

}  // namespace substep
