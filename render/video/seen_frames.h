#pragma once
/// What the cameras of a comparison are to hold.

#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns poses of all runs, each until a body is farther from the scene's middle than in the calmer half of
/// the runs, and than a ball about the scene by a third. One that explodes does not push the others out of
/// sight.
std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison);

}  // namespace substep::render
