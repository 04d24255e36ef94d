#pragma once
/// A scene in the terms that physics engines share: bodies with finite masses, ball joints, hinges and fixed
/// joints, one friction. What is beyond them is refused with the reason, so that no engine runs another
/// scene.

#include <set>
#include <utility>
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
  /// Pairs of units that do not meet, the lower first. A unit is a body, or a collider of the world
  /// (unit_of()).
  std::set<std::pair<int, int>> apart;
};

/// Returns the unit of a collider: its body's index or, in the world, the number of bodies and its own index.
inline int unit_of(const Scene& scene, int collider) {
  const int body = scene.colliders[static_cast<std::size_t>(collider)].body;
  return body != world_body ? body : static_cast<int>(scene.bodies.size()) + collider;
}

/// Abilities of an engine's adapter beyond the terms that all share.
struct EngineAbilities {
  bool filters = false;        ///< collision filters, as EngineScene::apart
  bool moving_bodies = false;  ///< kinematic bodies that move, with joints on them
};

/// Throws Error with what cannot be represented: limits, drives, springs, restitution, several frictions,
/// infinite moments; and what the abilities lack.
EngineScene engine_scene(const Scene& scene, const EngineAbilities& abilities = {});

}  // namespace substep
