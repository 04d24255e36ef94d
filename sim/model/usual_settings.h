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

/// Returns whether joints close a loop of three bodies or more. The world and all bodies that no force moves
/// count as one. Several joints between the same two bodies, or within that one, close no loop.
bool has_loop(const Scene& scene, Springs springs);

/// Returns default_settings() with the scene's step. A1 to A5 get the scene's sub-steps n too, and A2 n
/// iterations, which are as many row solves as n sub-steps. Where joints close a loop, A3 takes 'plain'
/// joints, which lose 1 % of a four-bar's kinetic energy in 5 s where 'stable' ones lose 24 %; A4 and A5 take
/// 'stable' ones, which lose less than 'plain' ones there. But loads of more than fifty times their mass make
/// links stiff in the transverse direction, which only 'stable' joints hold. In loops A2 takes at least 200
/// iterations: with 10 a governor diverges.
Settings usual_settings(const Scene& scene, Algorithm algorithm);

/// Returns the iterations of A2 with as many row solves as n sub-steps of m iterations: n·m, at most 10⁹,
/// which check() refuses.
int iterations_at_equal_rows(int substeps, int iterations);

}  // namespace substep
