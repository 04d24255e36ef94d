#pragma once
/// Ablations measure the cost of each approximation from A3 to A5: the listing of A3 with one of them
/// switched on. Only measurements use them.

#include <array>
#include <string_view>
#include <vector>

#include "sim/constraints/contact_batch.h"
#include "sim/simulation.h"

namespace substep {

/// The approximation of A4 or A5 that is switched on in A3.
enum class Approximation {
  exact,                  ///< none: A3
  bias_update,            ///< proc4:16, βʲ⁺¹ = βʲ − J̆ʲ v̆ʲ, with J̆ʲ exact
  frozen_jacobian,        ///< proc4:15, J̆ʲ⁺¹ ≈ J̆ʲ, with βʲ⁺¹ exact
  summed_rotation,        ///< proc4:20, the rotation of the sum at the step's end
  current_jacobian_bias,  ///< A5's (IV.4.1): βʲ⁺¹ = β¹ − J̆ʲ⁺¹ Σ v̆, with J̆ exact
  all_of_a4,              ///< lines 15, 16 and 20: A4
};

inline constexpr std::array approximations{
    Approximation::exact,           Approximation::bias_update,           Approximation::frozen_jacobian,
    Approximation::summed_rotation, Approximation::current_jacobian_bias, Approximation::all_of_a4};

/// "bias update", as tables print it.
std::string_view name(Approximation approximation);

/// Returns a procedure for Simulation with settings of A3. It keeps buffers, so each simulation needs its
/// own. 'Stable' joints recompute their Jacobian in all approximations, as in A4.
Procedure ablation_procedure(Approximation approximation);

/// Returns the cost of each approximation, in the order of `approximations`: the largest distance of a body
/// from its position in A3 with plain joints at the horizon, m.
std::vector<double> ablation_costs(const Scene& scene, int substeps, double horizon);

}  // namespace substep
