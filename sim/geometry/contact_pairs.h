#pragma once
/// The pairs of kinds of shapes, one function each. All append to `out` the contacts of `a` and `b` as
/// find_contacts does, with the normal from b to a, in this order of arguments only.

#include "sim/geometry/contact.h"
#include "sim/geometry/round_shapes.h"

namespace substep {

/// Finds contacts of capsules; a sphere is a capsule without length.
void find_capsule_capsule(const Capsule& a, const Pose& pose_a, const Capsule& b, const Pose& pose_b,
                          double margin, Contacts& out);
void find_capsule_plane(const Capsule& a, const Pose& pose_a, const Pose& plane, double margin,
                        Contacts& out);
void find_capsule_polytope(const Capsule& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           double margin, Contacts& out);

void find_plane_polytope(const Pose& plane, const Polytope& b, const Pose& pose_b, double margin,
                         Contacts& out);

void find_polytope_polytope(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                            double margin, Contacts& out);
void find_box_box(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b, double margin,
                  Contacts& out);

/// Finds contacts of cylinders, cones and tapered capsules, placed in the world. Any round shape will do for
/// the other one of a pair.
void find_revolved_plane(const RevolvedSolid& a, const Pose& plane, double margin, Contacts& out);
void find_revolved_revolved(const RevolvedSolid& a, const RevolvedSolid& b, double margin, Contacts& out);
/// `a` is a TaperedCapsule or Cylinder.
void find_round_polytope(const Shape& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                         double margin, Contacts& out);

/// Finds contacts of any shape but a plane or a mesh with a mesh. Neighbouring triangles in one plane touch
/// as one face, at the corners of their hull.
void find_shape_mesh(const Shape& a, const Pose& pose_a, const TriangleMesh& b, const Pose& pose_b,
                     double margin, Contacts& out);

/// Finds the one contact of two polytopes that are `separation` > 0 apart along `axis` (unit, in the world,
/// from a to b) but where no face lies over the other: their closest points.
void find_closest_features(const Polytope& a, const Pose& pose_a, const Polytope& b, const Pose& pose_b,
                           const Vector3& axis, double separation, double margin, Contacts& out);

/// Moves contacts from index `first` on from the frame of `pose` to the world.
inline void place(const Pose& pose, std::size_t first, Contacts& out) {
  for (std::size_t i = first; i < out.size(); ++i) {
    out[i].on_a = pose * out[i].on_a;
    out[i].on_b = pose * out[i].on_b;
    out[i].normal = pose.orientation * out[i].normal;
  }
}

/// Returns the separation by which another axis must exceed a face axis to be chosen.
inline double face_preference(double separation, double size) {
  return 0.05 * (separation < 0 ? -separation : separation) + 1e-3 * size;
}

/// Returns the separation by which a face of the second shape must exceed that of an equal one of the first.
inline double second_face_preference(double separation, double size) {
  return 0.1 * face_preference(separation, size);
}

}  // namespace substep
