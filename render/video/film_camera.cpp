#include "render/video/film_camera.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/motion.h"

namespace substep::render {
namespace {

/// Returns the index of a body. Throws Error that lists the bodies where none has this name.
int body_named(const std::string& name, const Scene& scene) {
  std::string known;
  for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
    if (scene.bodies[body].name == name) return static_cast<int>(body);
    if (body <= 12) known += (body > 1 ? ", " : "") + scene.bodies[body].name;
  }
  if (scene.bodies.size() > 13) known += ", …";
  throw Error("--camera follow:{}: {} has no such body: {}", name, scene.name, known);
}

/// Returns the scene's camera that has this name, or whose node has it. Throws Error.
Camera scene_camera(const std::string& name, const Scene& scene) {
  // Prefer nodes' names, which differ; cameras may share one.
  for (const auto member : {&NamedCamera::node, &NamedCamera::camera}) {
    const auto found = std::ranges::find(scene.cameras, name, member);
    if (found != scene.cameras.end()) return found->view;
  }
  std::string known;
  for (const NamedCamera& camera : scene.cameras) known += (known.empty() ? "" : ", ") + camera.node;
  throw Error("--camera name:{}: {} has no such camera: {}", name, scene.name,
              known.empty() ? "it has none" : known);
}

/// Returns v rotated about +Y.
glm::dvec3 turned(const glm::dvec3& v, const SineCosine& by) {
  return {by.cosine * v.x + by.sine * v.z, v.y, by.cosine * v.z - by.sine * v.x};
}

/// Returns the largest distance of a body from `middle`, m.
double farthest(const Vector3& middle, const std::vector<Coordinates>& poses) {
  double result = 0;
  for (std::size_t body = 1; body < poses.size(); ++body) {
    const double distance = (poses[body].linear - middle).norm();
    result = std::max(result, std::isfinite(distance) ? distance : std::numeric_limits<double>::max());
  }
  return result;
}

}  // namespace

FilmCamera camera_named(const std::string& text, const Scene& scene) {
  FilmCamera camera;
  constexpr std::string_view own = "name:";
  constexpr std::string_view follow = "follow:";
  constexpr std::string_view orbit = "orbit:";
  if (text == "fit") {
    camera.is_automatic = true;
  } else if (text.starts_with(own)) {
    camera.named = scene_camera(text.substr(own.size()), scene);
  } else if (text.starts_with(follow)) {
    camera.follows = body_named(text.substr(follow.size()), scene);
  } else if (text.starts_with(orbit)) {
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data() + orbit.size(), end, camera.degrees_per_second);
    if (parsed.ec != std::errc{} || parsed.ptr != end || !std::isfinite(camera.degrees_per_second))
      throw Error("--camera '{}': give orbit:DEGREES, degrees per second of film", text);
  } else if (text != "scene") {
    throw Error("--camera '{}': give scene, fit, name:CAMERA, follow:BODY or orbit:DEGREES", text);
  }
  return camera;
}

FilmCamera still_camera_named(const std::string& text, const Scene& scene) {
  const FilmCamera camera = camera_named(text, scene);
  if (camera.follows != world_body || camera.degrees_per_second != 0)
    throw Error("--camera '{}': a picture has no time to move in: give scene, fit or name:CAMERA", text);
  return camera;
}

Scene seen_by(const FilmCamera& camera, const Scene& scene) {
  Scene seen = scene;
  if (camera.is_automatic) seen.camera.reset();
  if (camera.named) seen.camera = camera.named;
  return seen;
}

Vector3 middle_of(const Scene& scene) {
  Vector3 middle = Vector3::Zero();
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) middle += scene.bodies[i].pose.position;
  return middle / static_cast<double>(std::max<std::size_t>(1, scene.bodies.size() - 1));
}

View moved(const View& view, const FilmCamera& camera, const Vector3& shift, double seconds,
           const Vector3& middle) {
  View result = view;
  if (camera.follows != world_body && shift.allFinite())
    result.eye += glm::dvec3(shift.x(), shift.y(), shift.z());
  if (camera.degrees_per_second != 0) {
    const SineCosine by = sine_cosine(camera.degrees_per_second * seconds * std::numbers::pi / 180);
    const glm::dvec3 centre(middle.x(), middle.y(), middle.z());
    result.eye = centre + turned(view.eye - centre, by);
    result.right = turned(view.right, by);
    result.up = turned(view.up, by);
    result.forward = turned(view.forward, by);
  }
  return result;
}

std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison) {
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  const Vector3 middle = middle_of(scene);
  std::vector<double> reaches;
  for (const Run& run : comparison.runs) {
    double& reach = reaches.emplace_back(0);
    for (const std::vector<Coordinates>& poses : run.poses) reach = std::max(reach, farthest(middle, poses));
  }
  // Allow 1.1 of the runs' lower median distance, and at least 0.65 of the scene's size.
  std::ranges::sort(reaches);
  const double calm = reaches.empty() ? 0 : reaches[(reaches.size() - 1) / 2];
  const double most = std::max(1.1 * calm, 0.65 * size_of(scene));
  // Add 100 to 200 frames of a run, or all of a shorter one, until a body leaves that distance.
  const std::size_t stride = std::max<std::size_t>(1, comparison.times.size() / 100);
  for (const Run& run : comparison.runs) {
    for (std::size_t k = 0; k < run.poses.size(); k += stride) {
      if (farthest(middle, run.poses[k]) > most) break;
      frames.push_back(run.poses[k]);
    }
  }
  return frames;
}

}  // namespace substep::render
