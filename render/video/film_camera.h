#pragma once
/// From where a film looks, and how that changes from frame to frame.

#include <string>

#include "render/camera.h"
#include "sim/scene/scene.h"

namespace substep {

struct FilmCamera {
  bool is_automatic = false;      ///< not the scene's own, but one that fits all that moves
  int follows = world_body;       ///< the body that the camera goes along with, in each panel its own
  double degrees_per_second = 0;  ///< of film, about the vertical through the scene's middle
};

/// "scene", "fit", "follow:BODY" or "orbit:DEGREES", the turn in a second of film. Throws Error.
FilmCamera camera_named(const std::string& text, const Scene& scene);

/// `view` gone along with its body by `way`, or turned for `seconds` of film about the vertical through
/// `middle`.
View moved(const View& view, const FilmCamera& camera, const Vector3& way, double seconds,
           const Vector3& middle);

}  // namespace substep
