#pragma once
/// A scene in the terms that physics engines share: bodies with finite masses, ball joints, hinges and fixed
/// joints, one friction. What is beyond them is refused with the reason, so that no engine runs another
/// scene.

#include <vector>

#include "sim/scene/scene.h"

namespace substep {

struct EngineJoint {
  enum class Kind { ball, hinge, fixed } kind;
  int a;  ///< bodies; `a` is never the world
  int b;
  Vector3 anchor_a;  ///< in the bodies' frames
  Vector3 anchor_b;
  Vector3 axis_a;  ///< of a hinge, unit, in a's frame
  Vector3 axis_b;
};

struct EngineScene {
  std::vector<EngineJoint> joints;
  double friction = 0;        ///< of all colliders
  bool has_contacts = false;  ///< whether any two colliders can meet
};

/// Throws Error with what cannot be represented: limits, drives, springs, restitution, several frictions,
/// collision filters, moving kinematic bodies, infinite moments.
EngineScene engine_scene(const Scene& scene);

/// For engines in reduced coordinates: how each body hangs on the one before it.
struct EngineLink {
  int body;
  int parent;                ///< the world, or a body of an earlier link
  const EngineJoint* joint;  ///< null: it is free, and its parent is the world
  bool is_a;                 ///< whether `body` is the joint's a
};

/// Parents before children. Throws Error where joints close a loop.
std::vector<EngineLink> tree_of(const Scene& scene, const std::vector<EngineJoint>& joints);

/// The joint's anchor and axis in the frames of the link's body and of its parent.
Vector3 anchor_of_body(const EngineLink& link);
Vector3 anchor_of_parent(const EngineLink& link);
Vector3 axis_of_body(const EngineLink& link);

/// Angular velocity of the link's body relative to its parent at the start, in the body's frame.
Vector3 relative_spin(const Scene& scene, const EngineLink& link);

}  // namespace substep
