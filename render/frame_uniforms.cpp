#include "render/frame_uniforms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/units.h"

namespace substep::render {

void set_frame_units(GLuint program) {
  glUseProgram(program);
  const auto set = [program](const char* name, GLint unit) {
    glUniform1i(glGetUniformLocation(program, name), unit);
  };
  set("shadow_depth", shadow_depth_unit);
  set("shadow_test", shadow_test_unit);
  set("shadow_nearest", shadow_nearest_unit);
  set("occlusion_map", occlusion_unit);
  set("sample_depth", depth_unit);
  set("packed_surfaces", surface_unit);
}

glm::dvec4 set_light(FrameUniforms& frame, const Scene& scene, const Lamps& lamps, double ground) {
  // Where a file has other lights, it is they that it is meant to be seen by.
  const double illuminance = scene.lights.empty() ? 3 : 0;
  const Sun sun = scene.sun.value_or(Sun{{-0.55, -1, -0.45}, {1, 0.95, 0.88}, illuminance});
  const double length = sun.direction.norm();
  glm::dvec3 ray{0, -1, 0};
  if (length > 0 && std::isfinite(length)) {
    const Vector3 unit = sun.direction / length;
    ray = {unit.x(), unit.y(), unit.z()};
  }
  const glm::vec3 radiance(glm::dvec3(sun.color[0], sun.color[1], sun.color[2]) *
                           (sun.illuminance / std::numbers::pi));
  const glm::vec3 ground_color(0.46F, 0.415F, 0.36F);
  const glm::vec3 zenith(0.10F, 0.22F, 0.46F);
  const glm::vec3 horizon(0.70F, 0.78F, 0.86F);
  const glm::vec3 sky = 0.45F * zenith + 0.55F * horizon;
  const auto up = static_cast<float>(std::max(-ray.y, 0.0));
  const bool is_key = lamps.key < 0;
  const glm::dvec4 key =
      is_key ? glm::dvec4(-ray, 0) : glm::dvec4(lamps.places[static_cast<std::size_t>(lamps.key)]);
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
  // Where surfaces lie is read from the depth buffer: near enough to be exact to a ten-thousandth of `focus`.
  const double near = std::min(0.02 * focus, std::max(0.1, 0.002 * focus));
  const double far = 2.5 * reach;
  const glm::dmat4 from_world = clip_from_world(view, near, far);
  frame.depth_terms.x = static_cast<float>(near * far / (far - near));
  frame.depth_terms.y = static_cast<float>(far / (far - near));
  frame.clip_from_world = glm::mat4(from_world);
  const glm::dvec3 right = view.right * (2 * view.tangent_x / width);
  const glm::dvec3 up = view.up * (2 * view.tangent_y / height);
  frame.eye = glm::vec4(glm::vec3(view.eye), antialiasing ? 2 : 1);
  frame.ray_corner = glm::vec4(glm::vec3(view.forward + view.right * (view.shift_x - view.tangent_x) +
                                         view.up * (view.shift_y - view.tangent_y)),
                               0);
  frame.ray_right = glm::vec4(glm::vec3(right), 0);
  frame.ray_up = glm::vec4(glm::vec3(up), 0);
  // Lines a decimetre apart help where the picture shows a few metres only.
  const double fine = std::clamp((8 - focus) / 4, 0.0, 1.0);
  frame.ground_reach = {static_cast<float>(2.5 * focus), static_cast<float>(reach), static_cast<float>(fine),
                        static_cast<float>(2 * reach)};
  return from_world;
}

}  // namespace substep::render
