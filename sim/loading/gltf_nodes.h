#pragma once
/// The nodes of a glTF file as trees, and their transforms.

#include <string>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

struct GltfDocument;

/// An affine map, and its split into a rigid pose and a scale where there is one.
/// x_outer = linear * x_node + translation. Unless `sheared`, linear = R(rotation) * diag(scale), and the
/// components of `scale` are either all >= 0 or, for a node that mirrors, all <= 0.
struct NodeTransform {
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
  bool sheared = false;
  /// True where `rotation` is valid. That of a sheared map is the product of the nodes' rotations, without
  /// scales.
  bool has_rotation = true;
  Quaternion rotation = Quaternion::Identity();
  Vector3 scale = Vector3::Ones();

  bool mirrors() const { return sheared ? linear.determinant() < 0 : scale.minCoeff() < 0; }
  bool is_finite() const {
    return linear.allFinite() && translation.allFinite() && rotation.coeffs().allFinite() &&
           scale.allFinite();
  }
  /// Returns the pose without the scale, for what is its own mirror image in x: implicit shapes, joint
  /// frames, cameras and lights. Where the node mirrors, the pose keeps its y and z axes and reverses its x
  /// axis.
  Pose rigid() const;
};

NodeTransform make_transform(const Vector3& translation, const Quaternion& rotation, const Vector3& scale);

/// Returns the transform that only scales.
inline NodeTransform scaling(const Vector3& scale) {
  return make_transform(Vector3::Zero(), Quaternion::Identity(), scale);
}

/// Splits `linear` with square roots alone; axes that stand off square by more than 1e-6 make it sheared.
NodeTransform make_transform(const Matrix3& linear, const Vector3& translation);

/// First `inner`, then `outer`. Where the scales commute with the rotations, rotation and scale are composed
/// by themselves, so that a chain of unscaled nodes stays exactly unscaled.
NodeTransform compose(const NodeTransform& outer, const NodeTransform& inner);

struct GltfNode {
  std::string name;  ///< unique: "node 7" where the file gives none, " #2" appended to the second of a name
  int parent = -1;
  int depth = 0;  ///< 1 for a root
  std::vector<int> children;
  bool in_scene = false;  ///< reachable from the default scene
  int mesh = -1;          ///< −1: none
  int skin = -1;          ///< −1: none
  NodeTransform local;
  NodeTransform world;  ///< composed in double precision from the root down
};

/// Sets the document's nodes and default scene. Throws Error where the nodes do not form trees at most 256
/// deep, or where a transform is not finite.
void read_nodes(GltfDocument& document);

}  // namespace substep
