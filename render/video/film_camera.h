#pragma once
/// The camera of a film, and its motion from frame to frame.

#include <optional>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/video/comparison.h"

namespace substep::render {

struct FilmCamera {
  bool is_automatic = false;      ///< a camera that fits all moving bodies, instead of the scene's
  std::optional<Camera> named;    ///< one of the scene's, which does not step back
  int follows = world_body;       ///< the body that the camera moves with, in each panel its own
  double degrees_per_second = 0;  ///< turn about the vertical through the scene's middle, in a second of film
};

/// Reads "scene", "fit", "name:NAME" of a camera or its node, "follow:BODY" or "orbit:DEGREES". Throws Error.
FilmCamera camera_named(const std::string& text, const Scene& scene);

/// Reads the camera of a picture, which cannot move. Throws Error.
FilmCamera still_camera_named(const std::string& text, const Scene& scene);

/// Returns the scene with the camera at the start, or without one where the camera fits all.
Scene seen_by(const FilmCamera& camera, const Scene& scene);

/// Returns the mean of the bodies' positions at the start.
Vector3 middle_of(const Scene& scene);

/// Returns `view` moved by `shift`, m, with its body, or turned for `seconds` of film about the vertical
/// through `middle`.
View moved(const View& view, const FilmCamera& camera, const Vector3& shift, double seconds,
           const Vector3& middle);

/// Returns the poses that the cameras of a comparison must hold: those of each run until a body is farther
/// from the scene's middle than in the calmer half of the runs. So a run that explodes does not make the
/// others small.
std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison);

}  // namespace substep::render
