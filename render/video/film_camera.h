#pragma once
/// From where a film looks, and how that changes from frame to frame.

#include <optional>
#include <string>

#include "render/camera.h"
#include "sim/scene/scene.h"

namespace substep::render {

struct FilmCamera {
  bool is_automatic = false;      ///< not the scene's own, but one that fits all that moves
  std::optional<Camera> named;    ///< one of the scene's, which stays where it stands
  int follows = world_body;       ///< the body that the camera goes along with, in each panel its own
  double degrees_per_second = 0;  ///< of film, about the vertical through the scene's middle
};

/// "scene", "fit", "name:NAME" of a camera or its node, "follow:BODY" or "orbit:DEGREES", the turn in a
/// second of film. Throws Error.
FilmCamera camera_named(const std::string& text, const Scene& scene);

/// The same for a picture, which has no time to move in. Throws Error.
FilmCamera still_camera_named(const std::string& text, const Scene& scene);

/// The scene with the camera that it is to be seen by first, or with none for one that fits all.
Scene seen_by(const FilmCamera& camera, const Scene& scene);

/// Returns the mean of the bodies' places at the start.
Vector3 middle_of(const Scene& scene);

/// `view` gone along with its body by `way`, or turned for `seconds` of film about the vertical through
/// `middle`.
View moved(const View& view, const FilmCamera& camera, const Vector3& way, double seconds,
           const Vector3& middle);

}  // namespace substep::render
