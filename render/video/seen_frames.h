#pragma once
/// What the cameras of a comparison are to hold.

#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// What cameras look at: the reference where it is known for half of the film or more; else the calmer half
/// of the runs. One that explodes does not push the others out of sight.
std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison);

}  // namespace substep::render
