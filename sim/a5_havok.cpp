// Algorithm 5: Havok stepping, actual.
//
// | line | A4                | here                                              | measured by |
// |------|-------------------|---------------------------------------------------|-------------|
// | 5    | β, M̆⁻¹, λ         | β□ = (τ/κ)β¹, M□⁻¹ = κM̆⁻¹, λ□ = λ/κ               | claim 5     |
// | 8    | v̂⁰ = v̆ʲ⁻¹ + ext/n | m̂v⁰ = v̆ʲ⁻¹ + ext/n + svʲ                          | claim 5     |
// | 16   | βʲ⁺¹ = βʲ − J̆ʲ v̆ʲ | svʲ⁺¹ = svʲ + (τ/κ) v̆ʲ: all J̆ are the current one | claim 6     |
//
// The report calls mv 'Velocity' and sv 'SumVelocity', as Havok's code does. Neither is v̆ or its sum.

#include "sim/algorithms.h"
#include "sim/math/rotation.h"

namespace substep {

void proc5(CoordinateVector& q, VelocityVector& v_local, const Settings& settings, Problem& problem,
           Work& work) {
  const auto [n, usual_m, tau, kappa] = settings.substepping();
  const double contact_kappa = settings.of_contacts().kappa;
  const double hs = settings.step / n;
  Constraints& c = problem.c;

  // Step velocities
  // Sub-step
  VelocityVector& mv = v_local;  // m̂v from proc5:8 to proc5:15, v̆ otherwise
  VelocityVector& sum_v = work.sum_v;
  VelocityVector& sum = problem.substeps.offset;  // Σ v̆ᵏ
  set_zero(sum);
  set_zero(sum_v);
  clear_impulses(c);
  box_biases(c, settings);        // proc5:5
  for (int j = 1; j <= n; ++j) {  // proc5:6
    // Micro-iterate
    start_substep(problem, v_local, &sum_v);  // λ□ = 0, or with warm_start a fraction of λ□
    add_external(problem, hs, v_local);
    add(sum_v, mv);  // proc5:8
    const int m = sweeps_of(problem, usual_m);
    for (int i = 1; i <= m; ++i) {  // proc5:9
      for (Block& x : c.blocks) {   // proc5:10
        // J̆_x(m̂v + M̆⁻¹J̆_xᵀλ□) = β□_x : lo/κ, hi/κ
        update_stable(problem, x, mv, &sum_v);                        // proc5:11
        const Impulse boxed_lambda = solve(c, x, {}, mv, 1 / kappa);  // proc5:12
        apply(c, x, boxed_lambda, mv, kappa);                         // proc5:13
      }
      for (const ContactBatch& x : c.contacts.batches)
        solve_and_apply(c.contacts, x, {.scale = contact_kappa}, mv);
      work.row_solves += c.row_count();
    }
    // Sub-step 𝒞 to (t + j·hs)
    subtract(sum_v, mv);  // proc5:15
    renew_free_rotation(problem, hs, v_local);
    add(v_local, sum);
    add_scaled(tau / kappa, v_local, sum_v);              // proc5:16
    undo_update_rule(problem, settings, v_local, sum_v);  // β of rows whose factor is not τ/κ
    carry_momenta(problem, hs, v_local);
    // proc5:17, mvʲ⁺¹ = v̆ʲ + svʲ⁺¹, is at proc5:8 of the next sub-step, so that ext receives v̆
  }

  // Step coordinates; body 0 is the world
  // v̆' = v̆ⁿ, in place  // proc5:19
  for (std::size_t i = 1; i < q.size(); ++i) {
    q[i].linear += hs * sum[i].linear;                                               // proc5:20
    q[i].angular = compose(q[i].angular, rotation_quaternion(hs * sum[i].angular));  // proc5:21
  }
}

}  // namespace substep
