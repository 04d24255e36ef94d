#pragma once
/// The transform of a glTF node: an affine map, and its split into a rigid pose and a scale where there is
/// one.

#include "sim/math/vector.h"

namespace substep {

/// x_outer = linear * x_node + translation. Unless `sheared`, linear = R(rotation) * diag(scale), and the
/// components of `scale` are either all >= 0 or, for a node that mirrors, all <= 0.
struct NodeTransform {
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
  bool sheared = false;
  /// True where `rotation` is valid although the map is sheared: it is the product of the nodes' rotations,
  /// without scales.
  bool turned = false;
  Quaternion rotation = Quaternion::Identity();
  Vector3 scale = Vector3::Ones();

  bool mirrors() const { return scale.minCoeff() < 0; }
  bool is_finite() const;
  /// Returns the pose without the scale, for parts that are rigidly attached to the node.
  Pose rigid() const { return {translation, rotation}; }
};

NodeTransform make_transform(const Vector3& translation, const Quaternion& rotation, const Vector3& scale);

/// Splits `linear` with square roots alone; axes that stand off square by more than 1e-6 make it sheared.
NodeTransform make_transform(const Matrix3& linear, const Vector3& translation);

/// First `inner`, then `outer`. Where the scales commute with the rotations, rotation and scale are composed
/// by themselves, so that a chain of unscaled nodes stays exactly unscaled.
NodeTransform compose(const NodeTransform& outer, const NodeTransform& inner);

}  // namespace substep
