#pragma once
/// Where a glTF node stands: an affine map, and its split into a rigid placement and a scale where it has
/// one.

#include "sim/math/vector.h"

namespace substep {

/// x_outer = linear * x_node + translation. Unless `sheared`, linear = R(rotation) * diag(scale), and the
/// components of `scale` are either all >= 0 or, for a node that mirrors, all <= 0.
struct NodeTransform {
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
  bool sheared = false;
  /// Whether `rotation` is meant although `sheared`: the nodes' rotations one after the other, without
  /// scales.
  bool turned = false;
  Quaternion rotation = Quaternion::Identity();
  Vector3 scale = Vector3::Ones();

  bool mirrors() const { return scale.minCoeff() < 0; }
  bool is_finite() const;
  /// The placement without the scale: what is rigidly attached to the node stands in it.
  Pose rigid() const { return {translation, rotation}; }
};

NodeTransform make_transform(const Vector3& translation, const Quaternion& rotation, const Vector3& scale);

/// Splits `linear` with square roots alone; axes that stand off square by more than 1e-6 make it sheared.
NodeTransform make_transform(const Matrix3& linear, const Vector3& translation);

/// First `inner`, then `outer`. Where the scales commute with the rotations, rotation and scale are composed
/// by themselves, so that a chain of unscaled nodes stays exactly unscaled.
NodeTransform compose(const NodeTransform& outer, const NodeTransform& inner);

}  // namespace substep
