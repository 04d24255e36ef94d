#pragma once
/// The default settings of a scene's runs.

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

/// Returns the ratio of the heaviest to the lightest mass among bodies that forces move; 1 where there are
/// none.
double mass_ratio(const Scene& scene);

/// Selects whether soft limits of joints count.
enum class Springs { count, skip };

/// Returns whether joints close a loop of three bodies or more, of which the world and all bodies that no
/// force moves are one. Several joints between the same two bodies close none.
bool has_loop(const Scene& scene, Springs springs);

/// default_settings() with the scene's step. The report's five get its sub-steps n too; A2 gets n iterations,
/// as many row solves.
/// Where joints close a loop, A3 takes 'plain' joints, which lose 1 % of a four-bar's kinetic energy in 5 s
/// where 'stable' ones lose 24 %; in A4 and A5 'stable' ones lose less. But under loads of more than fifty
/// times their mass links are stiff in the transverse direction, which only 'stable' ones hold. A2 takes 30
/// iterations at least there: with 10 a governor diverges.
Settings usual_settings(const Scene& scene, Algorithm algorithm);

}  // namespace substep
