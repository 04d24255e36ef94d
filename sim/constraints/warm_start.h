#pragma once
/// Warm starts: the impulses of a (sub-)step begin with a fraction of what the last one gave. Not the
/// report's.

#include <vector>

#include "sim/constraints/contact_batch.h"

namespace substep {

/// Sets what the contacts gave in the sub-step before the step's first, of `duration` seconds: from the
/// forces of Contact and PatchShape. `scale`: by which A5's impulses are smaller than λ□.
void set_given_before(ContactBatches& contacts, const std::vector<Contact>& found, double duration,
                      double scale);

/// λ ← λ + fraction · what the last sub-step gave, and v ← v + scale · M⁻¹Jᵀ of it. Manifolds with an impact
/// start from nothing.
void warm_start(ContactBatches& contacts, double fraction, double scale, std::vector<Velocity>& v);

/// Returns what a contact point gave in the last sub-step as a force, along its normal and tangents, N:
/// contact `i` of a lane's manifold, with `friction` its rows of friction; −1: it has none.
Vector3 force_of_point(const ContactBatches& contacts, const ContactBatch& x, int lane, int i, int friction);

/// Sets PatchShape::force from what a patch gave in the last sub-step.
void set_force(const ContactBatches& contacts, const ContactBatch& x, int lane, PatchShape& shape);

}  // namespace substep
