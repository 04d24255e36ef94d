#pragma once
/// Reads `extras.substep`, which holds what glTF's extensions lack, and chooses the default number of
/// sub-steps.

#include <string>

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

struct GltfDocument;

// The functions read the document's keys and those of its default scene, which override them.

/// Sets gravity, duration, step, poster and gyroscopic. Throws Error on an unknown key.
void read_settings(const GltfDocument& document, Scene& scene);

/// Sets `scene.expected`, the known figures of the motion. Bodies, gravity and duration must be set. Throws
/// Error.
void read_expectations(const GltfDocument& document, Scene& scene);

/// Sets substeps: `extras.substep.substeps`, else needed_substeps() of the bodies and joints, which must be
/// set.
void read_substeps(const GltfDocument& document, Scene& scene);

/// The most sub-steps that needed_substeps() gives.
inline constexpr int most_default_substeps = 100;
/// The fewest that needed_substeps() gives where joints close a loop without springs.
inline constexpr int substeps_in_loop = 40;

/// Returns n for the masses M and m of the heaviest and the lightest body: √(2 M/m), rounded up, but at least
/// 10, at least 40 where joints close a loop without springs, and at most 100. A heavy body presses a light
/// one into the ground in proportion to M/m over n²: by 7.5 mm for M/m = 100 with n = 10 and for 1000 with n
/// = 32 (`scenes/heavy_on_light.md`). In a loop 'stable' joints lose energy in proportion to 1/n: four-bars
/// in A4 lose a quarter of the kinetic energy in 5 s with n = 10, 7 % with 40. A loop that springs close
/// needs no more than 10, and with light bodies a larger n makes it unstable. The report names no n.
int needed_substeps(const Scene& scene);

/// Returns why the settings' n may not suffice: the masses need more than the largest default, or A5 gets
/// worse with so many. Empty where nothing speaks against n.
std::string doubt_about_substeps(const Scene& scene, const Settings& settings);

}  // namespace substep
