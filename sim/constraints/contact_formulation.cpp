// s2 of contacts: rows, limits' origins and Γ, from coordinates.

#include "sim/constraints/patch_formulation.h"
#include "sim/constraints/point_formulation.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

[[gnu::always_inline]] inline void formulate_lanes(ContactBatches& contacts, const ContactBatch& x,
                                                   const Formulation& from) {
  const BatchBodies at = bodies_of(x, from);
  if (x.patch >= 0) return formulate_patch(contacts, x, at, from);
  formulate_points(contacts, x, at, from);
}

}  // namespace

void formulate(ContactBatches& contacts, const std::vector<Contact>& found, const std::vector<Coordinates>& q,
               const std::vector<Matrix3>& rotations, double hs) {
  const bool anew = contacts.formulations > 0;
  if (!anew) contacts.first_rotations = rotations;
  const Formulation from{found, q, rotations, hs, anew, contacts.first_rotations};
  run_wide([&]() __attribute__((always_inline)) {
    for (const ContactBatch& x : contacts.batches) formulate_lanes(contacts, x, from);
  });
  ++contacts.formulations;
}

}  // namespace substep
