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

}  // namespace substep
