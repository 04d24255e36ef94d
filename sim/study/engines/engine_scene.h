#pragma once
/// A scene in the terms that physics engines share: bodies with finite masses, ball joints, hinges and fixed
/// joints, one friction. Other scenes are refused with the reason, so that no engine runs a different scene.
/// Also the function that each engine's module has. A module is a file beside the program, loaded on demand,
/// so that the program runs where the engine is not installed.

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/measure/stepper.h"
#include "sim/scene/scene.h"

namespace substep {

struct EngineJoint {
  enum class Kind { ball, hinge, fixed } kind;
  int a;  ///< bodies; `a` is never the world
  int b;
  Vector3 anchor_a;  ///< in the bodies' frames, m
  Vector3 anchor_b;
  Vector3 axis_a;  ///< of a hinge, unit, in a's frame
  Vector3 axis_b;
};

struct EngineScene {
  std::vector<EngineJoint> joints;
  double friction = 0;        ///< of all colliders
  bool has_contacts = false;  ///< true where two colliders can meet
  /// Pairs of units that do not meet, the lower first; empty where the engine has no filters. A unit is a
  /// body, or a collider of the world (unit_of()).
  std::set<std::pair<int, int>> apart;
};

/// Returns the unit of a collider: its body's index or, in the world, the number of bodies and its own index.
inline int unit_of(const Scene& scene, int collider) {
  const int body = scene.colliders[static_cast<std::size_t>(collider)].body;
  return body != world_body ? body : static_cast<int>(scene.bodies.size()) + collider;
}

/// Returns the scene in these terms. Throws Error that names limits, drives, springs, restitution, several
/// frictions, infinite moments and, unless `has_filters_and_motion`, filters and kinematic bodies that move.
EngineScene engine_scene(const Scene& scene, bool has_filters_and_motion);

using MakeEngineStepper = Stepper*(const Scene& scene, const EngineScene& shared, const Settings& settings,
                                   const std::string& solver);

/// Makes a stepper that the caller owns. Each module has this function, which is found by its name, so that
/// it has C linkage and returns no unique_ptr. Throws Error where the engine cannot run the scene. Solvers:
/// - of ODE: "step", the direct one (Dantzig), or "QuickStep", projected successive over-relaxation;
/// - of Bullet: "SI", sequential impulses with warm starting and split impulse as shipped, or "Dantzig";
/// - of MuJoCo, in reduced coordinates with soft contacts, an integrator: "Euler" or "RK4".
/// QuickStep and SI make `settings.iterations` sweeps.
extern "C" MakeEngineStepper make_engine_stepper;

}  // namespace substep
