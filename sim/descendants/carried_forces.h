#pragma once
/// State that Soft Step and AVBD carry from step to step: forces of contacts and joints, and AVBD's
/// penalties.

#include <vector>

#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

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

/// Returns the contact cache for the next step, sorted as ContactFinder reads it.
void remember(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
              std::vector<ContactMemory>& memory);

/// Appends the contacts' impulses, with the bodies at q.
void append_contact_impulses(const std::vector<Contact>& found, const std::vector<CarriedForce>& forces,
                             const std::vector<Coordinates>& q, std::vector<ContactImpulse>& result);

}  // namespace substep
