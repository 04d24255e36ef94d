#pragma once
/// Soft Step: sub-steps with soft constraints. It is not the report's.
///
/// Erin Catto, "Solver2D" (2024); the parameters are those of Box2D 3 and Box3D. This code is written from
/// the published description.

#include <cstdint>
#include <vector>

#include "sim/constraints/formulate.h"
#include "sim/descendants/carried_forces.h"
#include "sim/model/settings.h"

namespace substep {

/// A soft row: λ' = −mass_scale M (J v + bias_rate C) − impulse_scale λ, with C the position error and λ the
/// row's impulse so far. It acts as an implicit spring and damper in the sub-step.
struct Softness {
  double bias_rate;      ///< 1/s
  double mass_scale;     ///< κ of A3, in a row without an accumulated impulse
  double impulse_scale;  ///< fraction of λ that is removed

  /// τ of A3 for the same row.
  double tau(double hs) const { return mass_scale * bias_rate * hs; }
};

inline constexpr double soft_contact_damping = 10;  ///< ζ; half of it where one body cannot move
inline constexpr double soft_joint_damping = 2;     ///< ζ

/// Returns the softness of a spring with a frequency in Hz and a damping ratio, in sub-steps of hs seconds.
Softness softness(double hertz, double damping_ratio, double hs);

/// One direction of a contact point: J of both bodies, angular parts in their frames.
struct SoftRow {
  Vector3 linear;  ///< of body a; that of b is −linear
  Vector3 angular_a;
  Vector3 angular_b;
};

/// A contact point of a step: a normal and two directions of friction.
struct SoftPoint {
  int a;
  int b;
  SoftRow row[3];  ///< normal, tangents
  Vector3 arm_a;   ///< body frames
  Vector3 arm_b;
  Vector3 impulse;       ///< λ of the sub-step, N·s
  Vector3 given;         ///< λ of the step so far, N·s
  double gap_offset;     ///< m
  double gap;            ///< where the bodies are, m
  double normal_mass;    ///< 1/Γ of the normal
  double friction_mass;  ///< 1 / the larger eigenvalue of the tangents' Γ
  double friction;
  double restitution;
  double velocity;  ///< along the normal when the step begins, m/s
  Softness softness;
};

/// Buffers that outlive a step, and the step's report.
struct SoftStepWork {
  std::vector<SoftPoint> points;
  std::int64_t row_solves = 0;
};

/// Makes a step of settings.substeps sub-steps: steps `q` and `v_local`, whose angular velocities are in the
/// bodies' frames. `problem` holds the joints' blocks, formulated at q, with their first impulses, and the
/// contacts that were found. `carried` receives the forces at the step's end.
void soft_step(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
               Problem& problem, SoftStepWork& work, CarriedForces& carried);

}  // namespace substep
