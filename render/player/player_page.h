#pragma once
/// A page that plays a comparison in a browser.

#include <string>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns the quantities that every page shows: energies and, where the scene has joints, gaps.
QuantityChoice player_quantities(const Scene& scene);

/// Returns a page that plays the runs' poses at every film frame, to 4e-6 of the scene's size and 3e-5 rad.
/// Bodies look as in animated_glb(), with images within ImageLimits. `speed`: at the start, s of the scene
/// a second. The page is one file that needs no other and requests nothing; in a browser without
/// WebGL 2 it shows all but the pictures.
std::string player_page(const Scene& scene, const Comparison& comparison, const std::string& title,
                        double speed);

}  // namespace substep::render
