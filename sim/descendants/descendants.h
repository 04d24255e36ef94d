#pragma once
/// Two methods that are not the report's: Soft Step (soft_step.cpp) and augmented vertex block descent
/// (avbd.cpp). Both carry forces of contacts and joints from step to step; AVBD also carries penalties.

#include <cstdint>
#include <vector>

#include "sim/constraints/formulate.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"

namespace substep {

/// Returns a contact's row along its normal (k = 0) or a tangent, angular parts in the bodies' frames.
Jacobian contact_jacobian(const Contact& contact, const Problem& problem, int k);

/// The forces at a contact point, along its normal and tangents.
struct CarriedForce {
  Vector3 impulse;       ///< on a, of the step, N·s
  Vector3 force;         ///< on a, at the step's end, N
  Vector3 stiffness;     ///< AVBD: penalties, N/m
  Vector3 displacement;  ///< AVBD: displacement that friction holds, m; 0 along the normal
};

/// The forces at a step's end.
struct CarriedForces {
  std::vector<CarriedForce> contacts;  ///< of those found
  std::vector<double> joints;          ///< State::joint_forces
};

/// Writes the contact cache for the next step, sorted as ContactFinder reads it.
void remember(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
              std::vector<ContactMemory>& memory);

/// Appends the contacts' impulses and points in the world, with the bodies at q.
void append_contact_impulses(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
                             const std::vector<Coordinates>& q, std::vector<ContactImpulse>& result);

// Soft Step: sub-steps with soft constraints.

/// A soft row: λ' = −m mass_scale (J v + bias_rate C) − impulse_scale λ, with C the position error and λ the
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

/// A contact point of a step: a normal and two directions of friction.
struct SoftPoint {
  int a;
  int b;
  Jacobian row[3];  ///< normal, tangents
  Vector3 arm_a;    ///< from the centre of mass to the point, m, body frames
  Vector3 arm_b;
  Vector3 impulse;       ///< λ of the sub-step, N·s
  Vector3 step_impulse;  ///< λ of the step so far, N·s
  double gap_offset;     ///< m
  double gap;            ///< at the current coordinates, m
  double normal_mass;    ///< 1/Γ of the normal
  double friction_mass;  ///< 1 / the larger eigenvalue of the tangents' Γ
  double friction;
  double restitution;
  double velocity;  ///< along the normal when the step begins, m/s
  Softness softness;
};

/// Makes a step of settings.substeps sub-steps: steps `q` and `v_local`, whose angular velocities are in the
/// bodies' frames. `problem` holds the joints' blocks, formulated at q, with their first impulses, and the
/// contacts that were found. `points` is a buffer. `carried` receives the forces at the step's end. Returns
/// the number of row solves.
std::int64_t soft_step(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
                       Problem& problem, std::vector<SoftPoint>& points, CarriedForces& carried);

// AVBD.

/// One constraint of a step: C = value + J Δq, with Δq the bodies' displacement since the step began.
struct AvbdRow {
  Jacobian j;
  double
      value;  ///< C at the step's start less the part that the step keeps; of stabilized joints −α C; m, rad
  double force;      ///< λ: the force on a along J, N or N·m; the paper's has the opposite sign
  double penalty;    ///< k, N/m or N·m/rad
  double stiffness;  ///< of a spring; infinite for rigid rows
  double growth;     ///< β: the penalty's growth per |C|, N/m² or N·m/rad²
  double low;        ///< limits of the force, N or N·m
  double high;
};

/// A joint's block, or a contact point with its normal and two tangents.
struct AvbdBlock {
  int a;
  int b;
  int first;  ///< index of its first row
  int rows;
  int joint;        ///< index in Constraints::blocks; −1: a contact
  double friction;  ///< μ of a contact
};

/// Buffers that outlive a step.
struct AvbdWork {
  std::vector<AvbdRow> rows;
  std::vector<AvbdBlock> blocks;
  std::vector<int> begins;             ///< by body: its first index in `blocks_of`
  std::vector<int> blocks_of;          ///< indices of `blocks`
  std::vector<Coordinates> inertial;   ///< the coordinates without constraints
  std::vector<Velocity> displacement;  ///< since the step began: m, and the rotation vector, body frame
  std::vector<std::uint8_t> sticks;    ///< by block: 1 where friction holds it
};

/// Makes a step of settings.iterations iterations: steps `q` and `v_local`, whose angular velocities are in
/// the bodies' frames. `problem` holds the joints' blocks and the contacts that were found. `start` has the
/// forces and penalties of joints' rows when the step begins (State::joint_forces), `carried` those when it
/// ends. Returns the number of row solves.
std::int64_t avbd(std::vector<Coordinates>& q, std::vector<Velocity>& v_local, const Settings& settings,
                  Problem& problem, const std::vector<double>& start, AvbdWork& work, CarriedForces& carried);

}  // namespace substep
