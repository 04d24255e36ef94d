#pragma once
/// q and v: the coordinates and velocities of all bodies, in contiguous arrays.

#include <cstdint>
#include <vector>

#include "sim/math/vector.h"
#include "sim/model/patch_shape.h"
#include "sim/scene/scene.h"

namespace substep {

struct Model;

/// q of one body: centre of mass in the world, unit quaternion body frame → world.
struct Coordinates {
  Vector3 linear = Vector3::Zero();
  Quaternion angular = Quaternion::Identity();
};

/// v of one body. Linear: of the centre of mass, world. Angular: in the
/// world (v), or in the body frame (v̆) in functions that take `v_local`.
struct Velocity {
  Vector3 linear = Vector3::Zero();
  Vector3 angular = Vector3::Zero();
};

/// The cached data of a contact point, which the next step finds by its position on both bodies.
struct ContactMemory {
  int collider_a;  ///< indices of Scene::colliders
  int collider_b;
  Vector3 arm_a;  ///< the point in the body frame of a, m
  Vector3 arm_b;  ///< and of b
  /// Displacement of a's point from b's, across the normal, since the contact began or last slid; body frame
  /// of b, m.
  Vector3 displacement;
  bool slides;       ///< the point slides and has no displacement
  double left_over;  ///< part of the initial overlap that is still to be recovered, m
  /// Force of the last (sub-)step on a, from which warm starts continue; body frame of b, N. Zero in A2 to A5
  /// without a warm start.
  Vector3 force = Vector3::Zero();
  Vector3 stiffness = Vector3::Zero();  ///< AVBD's penalties along the normal and tangents, N/m
};

/// The impulse of two bodies at a contact point over a step.
struct ContactImpulse {
  int a;
  int b;
  Vector3 point;    ///< on a, world, m
  Vector3 impulse;  ///< on a, with friction; world, N·s
};

/// The state between steps; index 0 is the world. Angular velocities are in the world frame. A run that
/// continues from a state equals the run that led to it, to the last bit.
struct State {
  std::vector<Coordinates> q;
  std::vector<Velocity> v;
  std::vector<ContactMemory> contacts;  ///< sorted by colliders; not of A1
  std::vector<PatchShape> patches;      ///< A2 to A5
  /// Forces of the joints' rows in the last (sub-)step, from which warm starts continue, N or N·m; AVBD
  /// appends the rows' penalties. Empty without a warm start.
  std::vector<double> joint_forces;
  /// A1: the transverse frequency of bodies under the joints' forces of the last step, rad/s, where it is
  /// high enough to divide the next step.
  double transverse_frequency = 0;
};

State initial_state(const Scene& scene);

/// Returns the 64-bit FNV-1a of the state's bits, without the world and `transverse_frequency`; −0 counts as
/// 0.
std::uint64_t hash(const State& state);

/// Returns true if every number is finite; else sets `body` to the first body with one that is not. Bodies
/// that `model` says nothing moves come last: an impulse that is not finite reaches them along with the
/// diverged body.
bool is_finite(const State& state, int* body = nullptr, const Model* model = nullptr);

// Sums of velocities, body by body. Both arguments have the same number of bodies.

static_assert(sizeof(Velocity) == 6 * sizeof(double));

/// Returns all components of all bodies' velocities as one array.
inline auto components(std::vector<Velocity>& v) {
  return Eigen::Map<Eigen::ArrayXd>(reinterpret_cast<double*>(v.data()),
                                    6 * static_cast<Eigen::Index>(v.size()));
}
inline auto components(const std::vector<Velocity>& v) {
  return Eigen::Map<const Eigen::ArrayXd>(reinterpret_cast<const double*>(v.data()),
                                          6 * static_cast<Eigen::Index>(v.size()));
}

inline void set_zero(std::vector<Velocity>& v) {
  components(v).setZero();
}

inline void add(const std::vector<Velocity>& v, std::vector<Velocity>& to) {
  components(to) += components(v);
}

inline void subtract(const std::vector<Velocity>& v, std::vector<Velocity>& from) {
  components(from) -= components(v);
}

inline void scale(double factor, const std::vector<Velocity>& v, std::vector<Velocity>& result) {
  components(result) = factor * components(v);
}

inline void add_scaled(double factor, const std::vector<Velocity>& v, std::vector<Velocity>& to) {
  components(to) += factor * components(v);
}

}  // namespace substep
