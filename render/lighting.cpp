#include "render/lighting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/math/rotation.h"

namespace substep::render {
namespace {

glm::vec4 vector(const Vector3& v, double w) {
  return glm::dvec4(v.x(), v.y(), v.z(), w);
}

double illuminance_at(const Light& light, const Vector3& position) {
  if (light.kind == Light::Kind::directional) return light.intensity;
  return light.intensity / std::max((light.position - position).squaredNorm(), 1e-4);
}

/// Returns the mean of the parts' centres at the start, where lamps are compared.
Vector3 middle_of(const Scene& scene, std::span<const Part> parts) {
  Vector3 middle = Vector3::Zero();
  for (const Part& part : parts) middle += scene.bodies[part.body].pose * part.centre();
  return middle / static_cast<double>(std::max<std::size_t>(1, parts.size()));
}

void set(Lamps& lamps, int i, const Light& light, double brightness) {
  const bool is_far = light.kind == Light::Kind::directional;
  lamps.places[i] = is_far ? vector(-light.direction, 0) : vector(light.position, 1);
  const double reach = std::isfinite(light.range) && !is_far ? 1 / (light.range * light.range) : 0;
  lamps.axes[i] = vector(-light.direction, reach);
  lamps.cones[i] = {0, 1, 0, 0};
  if (light.kind == Light::Kind::spot) {
    const double outer = sine_cosine(light.outer_angle).cosine;
    const double scale = 1 / std::max(0.001, sine_cosine(light.inner_angle).cosine - outer);
    lamps.cones[i] = glm::dvec4(scale, -outer * scale, 0, 0);
  }
  const Vector3 color(light.color[0], light.color[1], light.color[2]);
  lamps.colors[i] = vector(color * (brightness * light.intensity / std::numbers::pi), 0);
}

}  // namespace

Lamps lamps_of(const Scene& scene, std::span<const Part> parts) {
  Lamps lamps;
  lamps.count = static_cast<int>(std::min(scene.lights.size(), most_lamps));
  const Vector3 middle = middle_of(scene, parts);
  double brightest = 0;
  double key = scene.sun ? scene.sun->illuminance : 0;
  lamps.has_sun = scene.sun ? key > 0 : scene.lights.empty();
  for (int i = 0; i < lamps.count; ++i) {
    const double illuminance = illuminance_at(scene.lights[i], middle);
    brightest = std::max(brightest, illuminance);
    if (!(illuminance > key)) continue;
    key = illuminance;
    lamps.key = i;
  }
  // Dim lamps of photometric brightness, whose files expect a camera's exposure, to at most 3.
  constexpr double brightest_without_exposure = 30;
  const double brightness = brightest > brightest_without_exposure ? 3 / brightest : 1;
  for (int i = 0; i < lamps.count; ++i) set(lamps, i, scene.lights[i], brightness);
  if (lamps.key >= 0) lamps.cones[lamps.key].z = 1;
  return lamps;
}

glm::dvec4 set_light(FrameUniforms& frame, const Scene& scene, const Lamps& lamps, double ground) {
  Sun sun = scene.sun.value_or(Sun{});
  // Only files without lights get the default sun.
  if (!scene.sun && !scene.lights.empty()) sun.illuminance = 0;
  const double length = sun.direction.norm();
  glm::dvec3 ray{0, -1, 0};
  if (length > 0 && std::isfinite(length)) ray = to_glm(sun.direction / length);
  const glm::vec3 radiance(glm::dvec3(sun.color[0], sun.color[1], sun.color[2]) *
                           (sun.illuminance / std::numbers::pi));
  const glm::vec3 ground_color(0.46F, 0.415F, 0.36F);
  const glm::vec3 zenith(0.10F, 0.22F, 0.46F);
  const glm::vec3 horizon(0.70F, 0.78F, 0.86F);
  const glm::vec3 sky = 0.45F * zenith + 0.55F * horizon;
  const auto up = static_cast<float>(std::max(-ray.y, 0.0));
  const bool is_key = lamps.key < 0;
  const glm::dvec4 key = is_key ? glm::dvec4(-ray, 0) : glm::dvec4(lamps.places[lamps.key]);
  frame.key = glm::vec4(key);
  frame.to_sun = glm::vec4(glm::vec3(-ray), is_key ? 1 : 0);
  frame.sun = glm::vec4(radiance, 0);
  frame.zenith = glm::vec4(zenith, 0);
  frame.horizon = glm::vec4(horizon, 0);
  frame.bounce = glm::vec4(ground_color * (radiance * up + sky) * 0.7F, 0);
  frame.ground_color = glm::vec4(ground_color, static_cast<float>(ground));
  return key;
}

glm::dmat4 set_view(FrameUniforms& frame, const View& view, int width, int height, bool antialiasing,
                    double focus) {
  const double reach = 40 * focus;
  // Keep the near plane far enough out that depths give positions exact to a ten-thousandth of `focus`.
  const double near = std::min(0.02 * focus, std::max(0.1, 0.002 * focus));
  const double far = 2.5 * reach;
  const glm::dmat4 from_world = clip_from_world(view, near, far);
  frame.depth_terms.x = static_cast<float>(near * far / (far - near));
  frame.depth_terms.y = static_cast<float>(far / (far - near));
  frame.clip_from_world = glm::mat4(from_world);
  frame.eye = glm::dvec4(view.eye, antialiasing ? 2 : 1);
  frame.ray_corner = glm::dvec4(
      view.forward + view.right * (view.shift_x - view.tangent_x) + view.up * (view.shift_y - view.tangent_y),
      0);
  frame.ray_right = glm::dvec4(view.right * (2 * view.tangent_x / width), 0);
  frame.ray_up = glm::dvec4(view.up * (2 * view.tangent_y / height), 0);
  // Fade in lines a decimetre apart where the picture shows only a few metres.
  const double fine = std::clamp((8 - focus) / 4, 0.0, 1.0);
  frame.ground_reach = glm::dvec4(2.5 * focus, reach, fine, 2 * reach);
  return from_world;
}

}  // namespace substep::render
