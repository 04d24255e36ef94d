#pragma once
/// What the engines' modules hold: a function for each stepper. A module is a file of its own beside the
/// program, so that an engine is loaded when it is asked for and the program runs where it is not installed.
/// All are given the scene, the same in the terms that engines share, and the settings; they throw Error
/// where that does not do.

#include "sim/measure/stepper.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {

/// Makes a stepper that the caller owns. Functions are found by name, so they have C linkage and return no
/// unique_ptr.
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
