#pragma once
/// The ladder from A3 to A5: the listing of A3 with one approximation switched on, so that what each costs in
/// accuracy is a number. Experiments: nothing else uses them.

#include <array>
#include <string_view>

#include "sim/simulation.h"

namespace substep {

/// Which of A4's and A5's approximations stands in A3's place.
enum class Rung {
  exact,                  ///< none: A3
  bias_update,            ///< proc4:16, βʲ⁺¹ = βʲ − J̆ʲ v̆ʲ, with J̆ʲ exact
  frozen_jacobian,        ///< proc4:15, J̆ʲ⁺¹ ≈ J̆ʲ, with βʲ⁺¹ exact
  summed_rotation,        ///< proc4:20, the rotation of the sum at the step's end
  current_jacobian_bias,  ///< A5's (IV.4.1): βʲ⁺¹ = β¹ − J̆ʲ⁺¹ Σ v̆, with J̆ exact
  all_of_a4,              ///< lines 15, 16 and 20: A4
};

inline constexpr std::array rungs{Rung::exact,           Rung::bias_update,           Rung::frozen_jacobian,
                                  Rung::summed_rotation, Rung::current_jacobian_bias, Rung::all_of_a4};

/// "bias update", as tables print it.
std::string_view name(Rung rung);

/// For Simulation, with settings of A3. Keeps buffers: one for each simulation. 'Stable' joints take their
/// Jacobian anew in all rungs, as in A4.
Procedure ladder_procedure(Rung rung);

}  // namespace substep
