#pragma once
/// Ablations measure the cost of each approximation from A3 to A5: the listing of A3 with one of them
/// switched on. Only measurements use them.

#include <array>
#include <string_view>
#include <vector>

#include "sim/constraints/contact_batch.h"
#include "sim/simulation.h"

namespace substep {

/// Approximations of A4 and A5, as switches over the listing of A3.
struct Approximation {
  std::string_view name;               ///< as tables print it
  bool bias_update = false;            ///< proc4:16, βʲ⁺¹ = βʲ − J̆ʲ v̆ʲ, with J̆ʲ exact
  bool frozen_jacobian = false;        ///< proc4:15, J̆ʲ⁺¹ ≈ J̆ʲ, with βʲ⁺¹ exact
  bool summed_rotation = false;        ///< proc4:20, the rotation of the sum at the step's end
  bool current_jacobian_bias = false;  ///< A5's (IV.4.1): βʲ⁺¹ = β¹ − J̆ʲ⁺¹ Σ v̆, with J̆ exact
  bool unstepped = false;  ///< 'stable' blocks know the coordinates as the start and the sum, as in A4

  bool exact_bias() const { return !bias_update && !current_jacobian_bias; }
};

/// No approximation, each one alone, and A4's together.
inline constexpr std::array<Approximation, 6> approximations{
    {{.name = "none (A3)"},
     {.name = "bias update", .bias_update = true},
     {.name = "frozen Jacobian", .frozen_jacobian = true},
     {.name = "summed rotation", .summed_rotation = true},
     {.name = "current Jacobian in the bias", .current_jacobian_bias = true},
     {.name = "all of A4's",
      .bias_update = true,
      .frozen_jacobian = true,
      .summed_rotation = true,
      .unstepped = true}}};

/// Returns a simulation by A3 with an approximation. 'Stable' joints recompute their Jacobian in all
/// approximations, as in A4.
Simulation ablated_simulation(const Scene& scene, Settings settings, const Approximation& approximation);

/// Returns the cost of each approximation, in the order of `approximations`: the largest distance of a body
/// from its position in A3 with plain joints at the horizon, m.
std::vector<double> ablation_costs(const Scene& scene, int substeps, double horizon);

}  // namespace substep
