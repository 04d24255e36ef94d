// Algorithm 3, Γ̂(t,h,n): Havok stepping, conceptual.
//
// | line | A2                     | here                                                 | measured by    |
// |------|------------------------|------------------------------------------------------|----------------|
// | 5    | one step of h          | n sub-steps of hs = h/n; geometry stays that of t    | claims 1, 2, 3 |
// | 7    | v, world               | v̆, local angular velocities; ext/n                   | claim 10       |
// | 8    | until converged or cap | m micro-iterations, no test                          | claim 3        |
// | 9    | row by row             | blocks of up to three rows where limits are infinite | claim 13       |
// | 11   | ω                      | τ, κ                                                 | claim 11       |
// | 15   | –                      | J̆, β from coordinates stepped exactly                | claims 2, 4    |
//
// Where the report is silent: λ starts at zero in each sub-step (line 7). The limits of λ hold for the
// impulse of the step so far, and τ and κ act on position-level rows alone, so that a motor reaches its own
// β (line 11). A contact's point on a ball is where the normal meets the ball, and once the bodies have met,
// the point on the body with which the normal turns follows the other body's (line 15). Beyond the report,
// contacts can have their own τ and κ (claim 17). Where contacts bounce, or joints transmit a hit, a sub-step
// takes more than m sweeps, since no later one restores an impulse that is missing (line 8). Contacts:
// contact_batch.h.

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {

void proc3(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work) {
  const auto [n, usual_m, tau, kappa] = settings.substepping();
  const auto [contact_tau, contact_kappa] = settings.of_contacts();
  const double hs = settings.step / n;
  Constraints& c = problem.c;
  Substeps& substeps = problem.substeps;

  // Step velocities
  // Sub-step
  VelocityVector& v_hat = v_local;  // proc3:4
  set_zero(work.sum);
  clear_impulses(c);
  for (int j = 1; j <= n; ++j) {  // proc3:5
    // Micro-iterate
    start_substep(problem, v_hat);     // λ = 0, or with warm_start a fraction of λ
    add_external(problem, hs, v_hat);  // proc3:7
    const int m = sweeps_of(problem, usual_m);
    for (int i = 1; i <= m; ++i) {  // proc3:8
      for (Block& x : c.blocks) {   // proc3:9
        // J̆_x(κ v̂ + M̆⁻¹J̆_xᵀλ) = τ β_xʲ : lo, hi
        update_stable(problem, x, v_hat);                                         // proc3:10
        const Impulse lambda = solve(c, x, {.tau = tau, .kappa = kappa}, v_hat);  // proc3:11
        apply(c, x, lambda, v_hat);                                               // proc3:12
      }
      for (const ContactBatch& x : c.contacts.batches)
        solve_and_apply(c.contacts, x, {.kappa = contact_kappa, .tau = contact_tau}, v_hat);
      work.row_solves += c.row_count();
    }
    renew_free_rotation(problem, hs, v_hat);
    add(v_hat, work.sum);  // proc3:13
    // Sub-step 𝒞 to (t + j·hs)
    step_coordinates(hs, v_local, substeps.stepped);  // proc3:15
    if (j < n) formulate(problem, substeps.stepped, hs);
    carry_momenta(problem, hs, v_local);
  }

  // Step coordinates; body 0 is the world
  // v̆' = v̆ⁿ, in place  // proc3:17
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += hs * work.sum[i].linear;      // proc3:18
    q[i].angular = substeps.stepped[i].angular;  // proc3:19
  }
}

}  // namespace substep
