#pragma once
/// The reference DAE integrator, for scenes whose forces are smooth: joints, springs and drives, no contacts.
///
/// The equations of motion in maximal coordinates, with the constraints at acceleration level (differentiated
/// twice: index 1),
///     M̆ v̆' = f + J̆ᵀλ,   J̆ v̆' = −J̆' v̆,
/// are stepped by Runge–Kutta or by the extrapolated midpoint rule (Gragg, Bulirsch, Stoer; Hairer, Nørsett,
/// Wanner, Solving Ordinary Differential Equations I, II.9). After each step coordinates and velocities are
/// projected back onto C(q) = 0 and J̆ v̆ = 0 (Hairer, Wanner, Solving Ordinary Differential Equations II,
/// VII.2). Rows are those of formulate.h. It is beside the report's algorithms, and what their errors are
/// measured against.
///
/// constrained_dynamics.h has the equations and the projection, jacobian_rate.h the term J̆' v̆,
/// event_detection.h limits and drives that switch.

#include "sim/measure/stepper.h"

namespace substep {

/// `order` 4: the classical Runge–Kutta method; other even orders up to 12: extrapolation. Throws Error where
/// the scene has contacts, or starts with open joints.
///
/// Closed loops have redundant rows. Rows that are linearly dependent to 1e-6, in the metric of the masses
/// where a step begins, are left out of the step; they hold by the others.
///
/// A step does not end at an event: it finds the events by bisection, and continues after each. step()
/// returns false also where a step has more than twenty events; the state is then that before the step.
std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order);

}  // namespace substep
