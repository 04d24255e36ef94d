#pragma once
/// An accurate mode for scenes whose forces are smooth: joints, springs and drives, no contacts.
///
/// The equations of motion in maximal coordinates with the constraints differentiated twice (index 1),
///     M̆ v̆' = f + J̆ᵀλ,   J̆ v̆' = −J̆' v̆,
/// stepped by Runge–Kutta or by the extrapolated midpoint rule (Gragg, Bulirsch, Stoer; Hairer, Nørsett,
/// Wanner, Solving Ordinary Differential Equations I, II.9) and projected back onto C(q) = 0 and J̆ v̆ = 0
/// after each step. Rows are those of formulate.h. It is beside the report's algorithms, and what their
/// errors are measured against.

#include "sim/measure/stepper.h"

namespace substep {

/// `order` 4: the classical Runge–Kutta method; other even orders up to 12: extrapolation. Throws Error where
/// the scene has contacts, or starts with open joints.
///
/// step() is false also where the motion is no longer smooth, and the state stays before that: a limit is met
/// that was open, or one that was held from the start on is let go.
std::unique_ptr<Stepper> reference_stepper(const Scene& scene, double step, int order);

}  // namespace substep
