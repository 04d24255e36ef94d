#pragma once
/// A stepper of each engine; only those are defined that the build found. All are given the scene in the
/// terms of engine_scene.h and throw Error where that does not do.

#include "sim/measure/stepper.h"

namespace substep {

/// ODE's direct solver (Dantzig), its defaults otherwise.
std::unique_ptr<Stepper> ode_world_step(const Scene& scene, const Settings& settings);
/// ODE's projected successive over-relaxation, `settings.iterations` sweeps.
std::unique_ptr<Stepper> ode_quick_step(const Scene& scene, const Settings& settings);

/// Bullet's sequential impulses, `settings.iterations` sweeps, warm starting and split impulse as it ships
/// them.
std::unique_ptr<Stepper> bullet_sequential_impulse(const Scene& scene, const Settings& settings);
/// Bullet's direct solver (Dantzig).
std::unique_ptr<Stepper> bullet_dantzig(const Scene& scene, const Settings& settings);
/// Bullet's articulated bodies in reduced coordinates; joints only. Semi-implicit Euler, or Runge–Kutta of
/// fourth order.
std::unique_ptr<Stepper> bullet_featherstone(const Scene& scene, const Settings& settings);
std::unique_ptr<Stepper> bullet_runge_kutta(const Scene& scene, const Settings& settings);

/// DART: reduced coordinates; contacts of boxes and spheres by its own detector and its Dantzig solver.
std::unique_ptr<Stepper> dart_stepper(const Scene& scene, const Settings& settings);

/// MuJoCo: reduced coordinates, soft contacts, its default solver; semi-implicit Euler, or Runge–Kutta of
/// fourth order.
std::unique_ptr<Stepper> mujoco_euler(const Scene& scene, const Settings& settings);
std::unique_ptr<Stepper> mujoco_runge_kutta(const Scene& scene, const Settings& settings);

}  // namespace substep
