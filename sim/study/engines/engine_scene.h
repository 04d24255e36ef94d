#pragma once
/// A scene in the terms that physics engines share: bodies with finite masses, ball joints, hinges and fixed
/// joints, one friction. What is beyond them is refused with the reason, so that no engine runs another
/// scene. And the functions of the engines' modules: a module is a file of its own beside the program, so
/// that an engine is loaded when it is asked for and the program runs where it is not installed.

#include <set>
#include <utility>
#include <vector>

#include "sim/measure/stepper.h"
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

/// Makes a stepper that the caller owns. Functions are found by name, so they have C linkage and return no
/// unique_ptr. They throw Error where the engine cannot do the scene.
using MakeEngineStepper = Stepper*(const Scene& scene, const EngineScene& shared, const Settings& settings);

extern "C" {

/// ODE's direct solver (Dantzig), its defaults otherwise.
MakeEngineStepper ode_world_step;
/// ODE's projected successive over-relaxation, `settings.iterations` sweeps.
MakeEngineStepper ode_quick_step;

/// Bullet's sequential impulses, `settings.iterations` sweeps, warm starting and split impulse as it ships
/// them.
MakeEngineStepper bullet_sequential_impulse;
/// Bullet's direct solver (Dantzig).
MakeEngineStepper bullet_dantzig;

/// MuJoCo: reduced coordinates, soft contacts, its default solver; semi-implicit Euler, or Runge–Kutta of
/// fourth order.
MakeEngineStepper mujoco_euler;
MakeEngineStepper mujoco_runge_kutta;
}

}  // namespace substep
