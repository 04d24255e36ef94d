#pragma once
/// Computes J̆' v̆, the second derivative of a row's C without acceleration: in closed form for locks, by
/// differences for limits. Internal to the reference integrator.

#include <algorithm>
#include <array>
#include <vector>

#include "sim/algorithms.h"

namespace substep {

class JacobianRate {
 public:
  /// Prepares the rows of `rigid`, a model with locks and two-sided limits alone. `size`: size of the scene,
  /// m.
  JacobianRate(const Model& rigid, double size) : size_(size), limit_model_(rigid) {
    limit_model_.locks.clear();
  }
  JacobianRate(const JacobianRate&) = delete;
  JacobianRate& operator=(const JacobianRate&) = delete;

  /// Must be called after the rows of `rigid` changed.
  void set_up(const Problem& rigid) {
    limit_model_.limits = rigid.model->limits;
    limit_.model = &limit_model_;
    limit_.contacts = &no_contacts_;
    build_blocks(limit_, Joints::rows);
    terms_.resize(rigid.c.rows.size());
  }

  /// Returns J̆' v̆ of each row; `rigid` is formulated at q.
  const std::vector<double>& terms(const Problem& rigid, const CoordinateVector& q, const VelocityVector& v) {
    const std::vector<Lock>& locks = rigid.model->locks;
    lock_terms_.resize(locks.size());
    for (std::size_t i = 0; i < lock_terms_.size(); ++i)
      lock_terms_[i] = term_of(locks[i], JointMotion(locks[i].at, q, rigid.rotations, v));
    set_limit_terms(q, v);
    for (const Block& x : rigid.c.blocks) {
      terms_[x.first] =
          x.kind == Block::Kind::lock ? lock_terms_[x.source][x.component] : limit_terms_[x.source];
    }
    return terms_;
  }

 private:
  /// The motion of a joint's two frames in the world.
  struct JointMotion {
    JointMotion(const Attachment& at, const CoordinateVector& q, const std::vector<Matrix3>& rotations,
                const VelocityVector& v)
        : axes_a(rotations[at.a] * at.frame_a.orientation.toRotationMatrix()),
          axes_b(rotations[at.b] * at.frame_b.orientation.toRotationMatrix()),
          spin_a(rotations[at.a] * v[at.a].angular),
          spin_b(rotations[at.b] * v[at.b].angular) {
      const Vector3 arm_a = rotations[at.a] * at.frame_a.position;
      const Vector3 arm_b = rotations[at.b] * at.frame_b.position;
      offset = q[at.a].linear + arm_a - (q[at.b].linear + arm_b);
      offset_rate = v[at.a].linear + spin_a.cross(arm_a) - (v[at.b].linear + spin_b.cross(arm_b));
      centripetal = spin_a.cross(spin_a.cross(arm_a)) - spin_b.cross(spin_b.cross(arm_b));
    }

    Matrix3 axes_a;
    Matrix3 axes_b;
    Vector3 spin_a;
    Vector3 spin_b;
    Vector3 offset;  ///< from b's origin to a's
    Vector3 offset_rate;
    Vector3 centripetal;
  };

  /// Returns J̆' v̆ of a lock's rows.
  static Vector3 term_of(const Lock& lock, const JointMotion& t) {
    if (lock.kind == Lock::Kind::point) return t.centripetal;
    if (lock.kind == Lock::Kind::orientation) {
      // C = 2 vec(q), q' = ½ Ω ∘ q: q'' = ½ Ω' ∘ q − ¼ Ω² q, with Ω in b's axes, which turn.
      const Matrix3 from_world = t.axes_b.transpose();
      Quaternion q(Matrix3(from_world * t.axes_a));
      if (q.w() < 0) q.coeffs() = -q.coeffs();
      const Vector3 turn_rate = from_world * t.spin_a.cross(t.spin_b);
      return q.w() * turn_rate + turn_rate.cross(q.vec()) -
             0.5 * (t.spin_a - t.spin_b).squaredNorm() * q.vec();
    }
    const Vector3 axis = t.axes_a.col(lock.axis);
    const Vector3 axis_rate = t.spin_a.cross(axis);
    const Vector3 axis_bend = t.spin_a.cross(axis_rate);
    Vector3 result = Vector3::Zero();
    for (int component = 0; component < 2; ++component) {
      const Vector3 across = t.axes_b.col((lock.axis + 1 + component) % 3);
      const Vector3 rate = t.spin_b.cross(across);
      const Vector3 bend = t.spin_b.cross(rate);
      result[component] = lock.kind == Lock::Kind::line
                              // C = offset · across
                              ? t.centripetal.dot(across) + 2 * t.offset_rate.dot(rate) + t.offset.dot(bend)
                              // direction: C = axis of a · across
                              : axis_bend.dot(across) + 2 * axis_rate.dot(rate) + axis.dot(bend);
    }
    return result;
  }

  /// Sets the terms of limits by the central difference of order 8 along the motion. The difference's time is
  /// short beside a turn and beside the bodies, so that its error is below rounding.
  void set_limit_terms(const CoordinateVector& q, const VelocityVector& v) {
    if (limit_model_.limits.empty()) return;
    constexpr std::array weights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    double rate = 0;
    for (const Velocity& body : v)
      rate = std::max(rate, body.angular.norm() + body.linear.norm() / (0.05 * size_));
    limit_terms_.assign(limit_model_.limits.size(), 0);
    const double shift = rate > 0 ? 0.02 / rate : 1;
    for (int k = 0; k < std::ssize(weights); ++k) {
      for (const int sign : {1, -1}) {
        shifted_ = q;
        step_coordinates(sign * (k + 1) * shift, v, shifted_);
        formulate(limit_, shifted_, 1);
        const double weight = sign * weights.at(k) / shift;
        for (const Block& x : limit_.c.blocks)
          limit_terms_[x.source] += weight * row_velocity(limit_.c.rows[x.first], v[x.a], v[x.b]);
      }
    }
  }

  double size_;
  std::vector<Contact> no_contacts_;
  Model limit_model_;  // the rigid limits by themselves
  Problem limit_;
  std::vector<Vector3> lock_terms_;
  std::vector<double> limit_terms_;
  std::vector<double> terms_;  // by row
  CoordinateVector shifted_;
};

}  // namespace substep
