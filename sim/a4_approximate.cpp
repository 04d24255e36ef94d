// Algorithm 4, Γ̂(t,h,ñ): Havok stepping, approximative.
//
// | line | A3                           | here                                     | measured by     |
// |------|------------------------------|------------------------------------------|-----------------|
// | 15   | J̆ʲ⁺¹ from exact coordinates  | J̆ʲ⁺¹ ≈ J̆ʲ; 'stable' blocks: from the sum | claims 4, 14    |
// | 16   | βʲ⁺¹ from exact coordinates  | βʲ⁺¹ = βʲ − J̆ʲ v̆ʲ                        | claims 4, 8, 12 |
// | 20   | the product of the rotations | the rotation of the sum                  | claims 4, 9     |

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {

void proc4(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work) {
  const auto [n, usual_m, tau, kappa] = settings.substepping();
  const auto [contact_tau, contact_kappa] = settings.of_contacts();
  const double hs = settings.step / n;
  Constraints& c = problem.c;
  Substeps& substeps = problem.substeps;

  // Step velocities
  // Sub-step
  VelocityVector& v_hat = v_local;  // proc4:4
  set_zero(work.sum);
  clear_impulses(c);
  for (int j = 1; j <= n; ++j) {  // proc4:5
    // Micro-iterate
    start_substep(problem, v_hat);     // λ = 0, or with warm_start a fraction of λ
    add_external(problem, hs, v_hat);  // proc4:7
    const int m = sweeps_of(problem, usual_m);
    for (int i = 1; i <= m; ++i) {  // proc4:8
      for (Block& x : c.blocks) {   // proc4:9
        // J̆_x(κ v̂ + M̆⁻¹J̆_xᵀλ) = τ β_xʲ : lo, hi
        update_stable(problem, x, v_hat);                                         // proc4:10
        const Impulse lambda = solve(c, x, {.tau = tau, .kappa = kappa}, v_hat);  // proc4:11
        apply(c, x, lambda, v_hat);                                               // proc4:12
      }
      for (const ContactBatch& x : c.contacts.batches)
        solve_and_apply(c.contacts, x, {.kappa = contact_kappa, .tau = contact_tau}, v_hat);
      work.row_solves += c.row_count();
    }
    renew_free_rotation(problem, hs, v_hat);
    add(v_hat, work.sum);  // proc4:13
    // Sub-step 𝒞 to (t + j·hs)
    add(v_hat, substeps.offset);      // proc4:15
    update_biases(problem, v_local);  // proc4:16
    carry_momenta(problem, hs, v_local);
  }

  // Step coordinates; body 0 is the world
  // v̆' = v̆ⁿ, in place  // proc4:18
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += hs * work.sum[i].linear;                                               // proc4:19
    q[i].angular = compose(q[i].angular, rotation_quaternion(hs * work.sum[i].angular));  // proc4:20
  }
}

}  // namespace substep
