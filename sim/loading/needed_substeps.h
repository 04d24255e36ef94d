#pragma once
/// How many sub-steps a scene is given that names none.

#include <string>

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

/// The most sub-steps that needed_substeps() gives.
inline constexpr int most_default_substeps = 100;
/// The fewest that it gives where joints close a loop without springs.
inline constexpr int substeps_in_loop = 40;

/// n of Scene::substeps by the masses M and m of the heaviest and the lightest body: √(2 M/m), rounded up,
/// but 10 at least, 40 where joints close a loop without springs, and 100 at most. A heavy body presses a
/// light one into the ground by what goes with M/m over n²: `scenes/heavy_on_light.md` has 7.5 mm for 100
/// with n = 10, for 1000 with n = 32. In a loop the energy that 'stable' joints lose goes with 1/n: of
/// four-bars in A4 a quarter of the kinetic energy in 5 s with 10, 7 % with 40. A loop that springs close
/// needs no more than 10, and with light bodies in it more make it unstable. The report names no n.
int needed_substeps(const Scene& scene);

/// Returns the number of sub-steps above which A5 with 'stable' joints gets worse (claim 6 of the report):
/// 100 for a chain of rods, 40 in loops, 20 in loops that springs close.
int most_substeps_of_a5(const Scene& scene);

/// Says why the settings' n will not hold the scene: the masses ask for more than any default has, or it is
/// one with which A5 gets worse. Empty where it may hold.
std::string doubt_about_substeps(const Scene& scene, const Settings& settings);

}  // namespace substep
