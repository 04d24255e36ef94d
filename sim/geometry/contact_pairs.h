#pragma once
/// The pairs of kinds of shapes, one function each. All append to `out` the contacts of `a` and `b` as
/// find_contacts does, with the normal from b to a, in this order of arguments only.

#include <optional>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/geometry/revolved_solid.h"
#include "sim/geometry/shape.h"

namespace substep {

void find_sphere_plane(const Sphere& a, const Pose& pose_a, const Pose& plane, double margin,
                       std::vector<ContactPoint>& out);
void find_sphere_polytope(const Sphere& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                          double margin, std::vector<ContactPoint>& out);

/// Spheres are capsules without length.
void find_capsule_capsule(const Capsule& a, const Pose& pose_a, const Capsule& b, const Pose& pose_b,
                          double margin, std::vector<ContactPoint>& out);
void find_capsule_plane(const Capsule& a, const Pose& pose_a, const Pose& plane, double margin,
                        std::vector<ContactPoint>& out);
void find_capsule_polytope(const Capsule& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           double margin, std::vector<ContactPoint>& out);

void find_plane_polytope(const Pose& plane, const Polytope& b, const Pose& pose_b, double margin,
                         std::vector<ContactPoint>& out);

void find_polytope_polytope(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                            double margin, std::vector<ContactPoint>& out);
void find_box_box(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out);

/// The pairs of cylinders, cones and tapered capsules. Solids a and b are placed in the world; any round
/// shape will do for the other one of a pair.
void find_revolved_plane(const RevolvedSolid& a, const Pose& plane, double margin,
                         std::vector<ContactPoint>& out);
void find_revolved_revolved(const RevolvedSolid& a, const RevolvedSolid& b, double margin,
                            std::vector<ContactPoint>& out);
/// `a` is a TaperedCapsule or Cylinder.
void find_round_polytope(const Shape& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                         double margin, std::vector<ContactPoint>& out);

/// Finds contacts of any shape but a plane or a mesh with a mesh. Neighbouring triangles in one plane touch
/// as one face, at the corners of their hull.
void find_shape_mesh(const Shape& a, const Pose& pose_a, const TriangleMesh& b, const Pose& pose_b,
                     double margin, std::vector<ContactPoint>& out);

/// Returns the revolved solid of a round shape; nothing for others.
std::optional<RevolvedSolid> as_revolved(const Shape& shape, const Pose& pose);

/// The one contact of two polytopes that are `separation` > 0 apart along `axis` (unit, in the world, from a
/// to b) but where no face lies over the other: their closest points.
void find_closest_features(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           const Vector3& axis, double separation, double margin,
                           std::vector<ContactPoint>& out);

/// Fraction of the preference by which a face of the second shape must be better than an equal one of the
/// first.
constexpr double second_face_share = 0.1;

/// Returns the separation by which another axis must exceed a face axis to be chosen.
inline double face_preference(double separation, double size) {
  return 0.05 * (separation < 0 ? -separation : separation) + 1e-3 * size;
}

}  // namespace substep
