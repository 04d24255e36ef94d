#pragma once
/// Writes a comparison as a page that plays it in a browser.

#include <string>

#include "render/video/comparison.h"

namespace substep::render {

/// The quantities that the page's strips show beside the runs' errors.
ReadingChoice player_readings(const Scene& scene);

/// The poses are the runs' at every film frame, to position_unit() and turn_parts; bodies look as in
/// animated_glb(), with images within ImageLimits. `speed` is that at which it begins, s of the scene a
/// second. The page is one file that needs no other and asks for nothing; in a browser without WebGL 2 it
/// shows all but the pictures.
std::string player_page(const Scene& scene, const Comparison& comparison, const std::string& title,
                        double speed);

}  // namespace substep::render
