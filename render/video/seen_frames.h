#pragma once
/// What the cameras of a comparison are to hold.

#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns poses of all runs, each until a body is farther from its start than the scene is large and than
/// twice the way of the calmer half of the runs. One that explodes does not push the others out of sight.
std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison);

}  // namespace substep::render
