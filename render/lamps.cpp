#include "render/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/math/rotation.h"

namespace substep::render {
namespace {

glm::vec4 vector(const Vector3& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
          static_cast<float>(w)};
}

double illuminance_at(const Light& light, const Vector3& place) {
  if (light.kind == Light::Kind::directional) return light.intensity;
  return light.intensity / std::max((light.position - place).squaredNorm(), 1e-4);
}

/// The point that lamps are compared at: the middle of the parts at the start.
Vector3 middle_of(const Scene& scene, std::span<const Part> parts) {
  Vector3 middle = Vector3::Zero();
  for (const Part& part : parts) {
    middle += scene.bodies[static_cast<std::size_t>(part.body)].pose * part.centre();
  }
  return middle / static_cast<double>(std::max<std::size_t>(1, parts.size()));
}

void set(Lamps& lamps, std::size_t i, const Light& light, double brightness) {
  const bool is_far = light.kind == Light::Kind::directional;
  lamps.places[i] = is_far ? vector(-light.direction, 0) : vector(light.position, 1);
  const double reach = std::isfinite(light.range) && !is_far ? 1 / (light.range * light.range) : 0;
  lamps.axes[i] = vector(-light.direction, reach);
  lamps.cones[i] = {0, 1, 0, 0};
  if (light.kind == Light::Kind::spot) {
    const double outer = sine_cosine(light.outer_angle).cosine;
    const double scale = 1 / std::max(0.001, sine_cosine(light.inner_angle).cosine - outer);
    lamps.cones[i] = {static_cast<float>(scale), static_cast<float>(-outer * scale), 0, 0};
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
    const double illuminance = illuminance_at(scene.lights[static_cast<std::size_t>(i)], middle);
    brightest = std::max(brightest, illuminance);
    if (!(illuminance > key)) continue;
    key = illuminance;
    lamps.key = i;
  }
  // Files with lamps as bright as real ones mean a camera that is stopped down.
  constexpr double brightest_without_exposure = 30;
  const double brightness = brightest > brightest_without_exposure ? 3 / brightest : 1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(lamps.count); ++i) {
    set(lamps, i, scene.lights[i], brightness);
  }
  if (lamps.key >= 0) lamps.cones[static_cast<std::size_t>(lamps.key)].z = 1;
  return lamps;
}

}  // namespace substep::render
