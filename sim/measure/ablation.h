#pragma once
/// Ablations, so that what each approximation and each reading costs is a number. From A3 to A5: the listing
/// of A3 with one approximation switched on. Of contacts: A5 with one reading of ContactReading taken out.
/// Experiments: nothing else uses them.

#include <array>
#include <string_view>

#include "sim/constraints/contact_batch.h"
#include "sim/simulation.h"

namespace substep {

/// Which of A4's and A5's approximations stands in A3's place.
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

/// For Simulation, with settings of A3. Keeps buffers: one for each simulation. 'Stable' joints take their
/// Jacobian anew in all approximations, as in A4.
Procedure ablation_procedure(Approximation approximation);

/// Which reading of contacts is taken out of all six.
enum class ContactAblation {
  all_six,              ///< none is: A5
  velocity_level,       ///< τ and κ act on velocity-level rows, too
  square_friction,      ///< each of a point's two friction rows has a limit of its own
  limits_by_substep,    ///< λ's limits hold for a sub-step's impulse
  file_order,           ///< a sweep has the order of the file
  single_normals,       ///< a manifold's normals are solved one by one
  forgetting_friction,  ///< friction sees the velocity of the moment only
};

inline constexpr std::array contact_ablations{ContactAblation::all_six,
                                              ContactAblation::velocity_level,
                                              ContactAblation::square_friction,
                                              ContactAblation::limits_by_substep,
                                              ContactAblation::file_order,
                                              ContactAblation::single_normals,
                                              ContactAblation::forgetting_friction};

/// "order of the file", as tables print it.
std::string_view name(ContactAblation approximation);

/// Whether what is taken out goes beyond the report; else it is read into it.
bool is_beyond_report(ContactAblation approximation);

/// For Simulation, with settings of A2 to A5.
ContactReading contact_reading(ContactAblation approximation);

}  // namespace substep
