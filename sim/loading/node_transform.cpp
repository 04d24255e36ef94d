#include "sim/loading/node_transform.h"

#include <algorithm>
#include <cmath>

namespace substep {
namespace {

// Two mirrored axes are half a turn about the third, and one is that plus all three. A half turn about an
// axis only permutes and negates the quaternion's components, so nothing is rounded.
void make_signs_equal(Quaternion& rotation, Vector3& scale) {
  const int negative = static_cast<int>((scale.array() < 0).count());
  if (negative != 1 && negative != 2) return;
  int odd = 0;  // the axis whose sign differs from the two others'
  while ((scale[odd] < 0) != (negative == 1)) ++odd;
  Quaternion half_turn(0, 0, 0, 0);
  half_turn.vec()[odd] = 1;
  rotation = rotation * half_turn;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != odd) scale[axis] = -scale[axis];
  }
}

}  // namespace

bool NodeTransform::is_finite() const {
  return linear.allFinite() && translation.allFinite() && rotation.coeffs().allFinite() && scale.allFinite();
}

NodeTransform make_transform(const Vector3& translation, const Quaternion& rotation, const Vector3& scale) {
  NodeTransform transform;
  transform.translation = translation;
  transform.rotation = rotation;
  transform.scale = scale;
  make_signs_equal(transform.rotation, transform.scale);
  transform.linear = transform.rotation.toRotationMatrix() * transform.scale.asDiagonal();
  return transform;
}

NodeTransform make_transform(const Matrix3& linear, const Vector3& translation) {
  NodeTransform transform;
  transform.linear = linear;
  transform.translation = translation;
  const Vector3 lengths{linear.col(0).norm(), linear.col(1).norm(), linear.col(2).norm()};
  if (!(lengths.minCoeff() > 0)) {  // an axis is lost, and with it the rotation
    transform.sheared = true;
    return transform;
  }
  Matrix3 axes = linear;
  for (int i = 0; i < 3; ++i) axes.col(i) /= lengths[i];
  const double skew =
      std::max({std::fabs(axes.col(0).dot(axes.col(1))), std::fabs(axes.col(1).dot(axes.col(2))),
                std::fabs(axes.col(2).dot(axes.col(0)))});
  if (!(skew <= 1e-6)) {
    transform.sheared = true;
    return transform;
  }
  transform.scale = lengths;
  if (axes.col(0).cross(axes.col(1)).dot(axes.col(2)) < 0) {
    axes = -axes;
    transform.scale = -lengths;
  }
  axes.col(1) = (axes.col(1) - axes.col(0).dot(axes.col(1)) * axes.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  transform.rotation = Quaternion(axes).normalized();
  return transform;
}

NodeTransform compose(const NodeTransform& outer, const NodeTransform& inner) {
  const bool uniform = outer.scale.x() == outer.scale.y() && outer.scale.y() == outer.scale.z();
  const bool unturned = inner.rotation.w() == 1;
  if (!outer.sheared && !inner.sheared && (uniform || unturned)) {
    const Vector3 translation =
        outer.rotation * outer.scale.cwiseProduct(inner.translation) + outer.translation;
    return make_transform(translation, (outer.rotation * inner.rotation).normalized(),
                          outer.scale.cwiseProduct(inner.scale));
  }
  NodeTransform transform = make_transform(Matrix3(outer.linear * inner.linear),
                                           Vector3(outer.linear * inner.translation + outer.translation));
  const auto has_rotation = [](const NodeTransform& one) { return !one.sheared || one.turned; };
  if (transform.sheared && has_rotation(outer) && has_rotation(inner)) {
    transform.turned = true;
    transform.rotation = (outer.rotation * inner.rotation).normalized();
  }
  return transform;
}

}  // namespace substep
