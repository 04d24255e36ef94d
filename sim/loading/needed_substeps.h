#pragma once
/// How many sub-steps a scene is given that names none.

#include "sim/scene/scene.h"

namespace substep {

/// How many times as heavy the heaviest body is as the lightest, of those that forces move; 1 where there are
/// none.
double mass_ratio(const Scene& scene);

/// n of Scene::substeps by the masses M and m of the heaviest and the lightest body: √(2 M/m), rounded up,
/// but 10 at least and 100 at most. What a heavy body presses a light one into the ground by goes with M/m
/// over n²: `scenes/heavy_on_light.md` has 7.5 mm for 100 with n = 10, for 1000 with n = 32. The report names
/// no n.
int needed_substeps(const Scene& scene);

}  // namespace substep
