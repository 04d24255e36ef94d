#pragma once
/// A case's run and its golden one as a page that plays both, to be looked at from all sides.

#include <span>
#include <string>
#include <vector>

#include "golden/compare/track.h"
#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep::golden {

/// player_page() of `live`, the scene's poses of frames 0, 1, …, body by body with the world first, beside
/// the golden run, which it shows as the reference, with the distance between them, up to frame `last`.
/// Throws Error where the golden run is of other bodies.
std::string motion_page(const Scene& scene, const Settings& settings,
                        std::span<const std::vector<Coordinates>> live, const Track& golden, int last);

}  // namespace substep::golden
