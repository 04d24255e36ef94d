#pragma once
/// Contact patches that the state keeps from step to step.

#include "sim/math/vector.h"

namespace substep {

constexpr int most_corners = 8;

/// A flat manifold as one polygon, at the coordinates at which it was found. Axes: the normal from b to a,
/// and two tangents. Lengths in m.
struct PatchShape {
  int a;  ///< bodies
  int b;
  int collider_a;  ///< indices of Scene::colliders; −1: the points are of several pairs of colliders
  int collider_b;
  int corners;
  bool is_kept;       ///< the patch was found in an earlier step
  bool slid;          ///< the patch slid already when the step began
  Vector3 arm_a;      ///< from a's centre of mass to the centre of the points on a, in a's frame
  Vector3 arm_b;      ///< from b's centre of mass to the centre of the points on b, in b's frame
  Matrix3 axes_in_a;  ///< columns: the axes in a's frame
  Matrix3 axes_in_b;  ///< columns: the axes in b's frame
  double tilt[2];     ///< slopes of the gap along the tangents
  double left[3];     ///< overlap that later steps recover: at the centre, m; its slopes along the tangents
  Vector3 reference;  ///< friction's displacement less the slip of the coordinates: tangents, m; twist, rad
  double friction;    ///< μ
  /// Forces from which a warm start continues: the force along the normal, the torques about the tangents;
  /// the forces along the tangents, the torque about the normal. N, N m; 0 without a warm start.
  double force[6] = {};
  double radius;     ///< mean distance of the points from their centre
  double left_over;  ///< the largest overlap of a point that is still to be recovered
  double margin;     ///< distance within which the points were found
  Vector3 position;  ///< of a's centre of mass from b's, in b's frame
  Quaternion turn;   ///< the rotation from a's frame to b's
  double corner[most_corners]
               [2];  ///< hull of the points, along the tangents from the centre, counterclockwise
};

/// Returns a patch's slip since it was found: along the tangents, m, and the twist, rad. `position`: a's
/// centre of mass from b's, in b's frame; `a_in_b`: the rotation from a's frame to b's.
inline Vector3 slip_of(const PatchShape& shape, const Vector3& position, const Matrix3& a_in_b) {
  const Matrix3 axes_now = a_in_b.transpose() * shape.axes_in_b;
  const Vector3 apart =
      shape.axes_in_b.transpose() * (position - shape.arm_b) + axes_now.transpose() * shape.arm_a;
  return {apart[1], apart[2], axes_now.col(2).dot(shape.axes_in_a.col(1))};
}

/// Returns the displacement by which a point of a patch has slid, m, body frame of b.
inline Vector3 displacement_at(const PatchShape& shape, const Vector3& slip, const Vector3& arm_b) {
  const Vector3 moved = slip + shape.reference;
  const Vector3 offset = shape.axes_in_b.transpose() * (arm_b - shape.arm_b);
  return shape.axes_in_b.col(1) * (moved[0] - moved[2] * offset[2]) +
         shape.axes_in_b.col(2) * (moved[1] + moved[2] * offset[1]);
}

}  // namespace substep
