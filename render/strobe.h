#pragma once
/// Several moments of a run in one picture.

#include <span>
#include <vector>

#include "render/image.h"
#include "render/renderer.h"

namespace substep::render {

/// The picture of the last of `moments` (poses of all bodies each, at least two), and in it the bodies where
/// they were at the others, the lighter the earlier. Where moments cover each other, the later is seen.
/// Throws Error where the picture is too large: its outlines are taken from one of twice its size.
Image strobe(const Scene& scene, const RenderSettings& settings,
             std::span<const std::vector<Coordinates>> moments);

}  // namespace substep::render
