// A sweep's visit of a batch: patches, or points.

#include "sim/constraints/patch_solve.h"
#include "sim/constraints/point_solve.h"
#include "sim/math/four_wide.h"

namespace substep {
namespace {

/// Solves a batch. For four corners, which boxes have, the kernel knows their number when it is compiled.
template <Kind kind>
[[gnu::always_inline]] inline bool solve_batch(ContactBatches& contacts, const Visit& at,
                                               std::vector<Velocity>& v, double* moved) {
  if (at.x.patch < 0) return solve_lanes<kind>(at, v, moved);
  Patch& patch = contacts.patches[at.x.patch];
  PatchCorner* const corners = contacts.patch_corners.data() + at.x.first_corner;
  if (at.x.corners == 4) return solve_patch<kind, 4>(at, corners, patch, v, moved);
  return solve_patch<kind, 0>(at, corners, patch, v, moved);
}

[[gnu::always_inline]] inline bool solve_any(ContactBatches& contacts, const Visit& at,
                                             std::vector<Velocity>& v, double* moved) {
  const RowSolve& how = at.how;
  const bool by_one = how.kappa == 1 && how.tau == 1 && how.omega == 1;
  if (moved || !by_one) return solve_batch<any_kind>(contacts, at, v, moved);
  return solve_batch<plain>(contacts, at, v, nullptr);
}

}  // namespace

void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved) {
  const Visit at{x,
                 contacts.directions.data() + x.first_normal,
                 contacts.normals.data() + x.first_normal,
                 contacts.frictions.data() + x.first_friction,
                 x.first_restitution < 0 ? nullptr : contacts.restitutions.data() + x.first_restitution,
                 contacts.couplings.data() + x.first_coupling,
                 how};
  const bool slides =
      run_wide([&]() __attribute__((always_inline)) { return solve_any(contacts, at, v, moved); });
  contacts.slides[&x - contacts.batches.data()] = slides ? 1 : 0;
}

}  // namespace substep
