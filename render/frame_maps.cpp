#include <algorithm>
#include <limits>

#include "render/gl.h"
#include "render/renderer_implementation.h"
#include "render/shadow_map.h"

namespace substep::render {

bool Renderer::Implementation::is_in_sight(const Coordinates& q) const {
  return is_drawable(q) && (q.linear - Vector3(view.eye.x, view.eye.y, view.eye.z)).norm() < sight;
}

/// Draws the map of what the light that casts shadows sees.
void Renderer::Implementation::fit_shadow(std::span<const Coordinates> poses) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    if (scenery[i] || !is_in_sight(q)) continue;
    for (const Vector3& corner : part.corners()) {
      const Vector3 p = q.angular * corner + q.linear;
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  const ShadowView seen =
      key.w > 0 ? fit_lamp_view(glm::dvec3(key), points) : fit_sun_view(-glm::dvec3(key), points);
  frame.shadow_from_world = glm::mat4(seen.map_from_world);
  // The large map takes as long as all else of a small picture. The small one does where its texels are finer
  // than the pixels.
  const double pixel = focus * 2 * view.tangent_y / settings.height;
  const double width = seen.width * seen.far;
  shadow = &device->shadow(width / 512 < 0.75 * pixel);
  frame.depth_terms.z = static_cast<float>(shadow->size);
  const double texel = width / shadow->size;
  frame.shadow_scale = {static_cast<float>(1 / seen.width), static_cast<float>(0.001 + 0.6 * texel),
                        static_cast<float>(seen.depth), settings.shadows ? 1.0F : 0.0F};
  if (!settings.shadows) return;
  shadow->start();
  glEnable(GL_DEPTH_CLAMP);
  draw_solid(device->depth_program, seen.clip_from_world, poses);
  glDisable(GL_DEPTH_CLAMP);
  shadow->finish();
}

void Renderer::Implementation::fit_occlusion(std::span<const Coordinates> poses) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Vector3 low = Vector3::Constant(infinite);
  Vector3 high = -low;
  double largest = 0.01;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    if (scenery[i] || !is_in_sight(q)) continue;
    low = low.cwiseMin(centre);
    high = high.cwiseMax(centre);
    largest = std::max(largest, part.half_size().norm());
  }
  if (!(low.x() < infinite)) low = high = Vector3::Zero();
  Relief relief;
  relief.width = std::max(high.x() - low.x(), high.z() - low.z()) + 6 * largest;
  const double low_x = (low.x() + high.x() - relief.width) / 2;
  const double low_z = (low.z() + high.z() - relief.width) / 2;
  draw_relief(poses, low_x, low_z, std::max(high.y() + 2 * largest - ground, 0.1), relief);
  frame.occlusion = {static_cast<float>(low_x), static_cast<float>(low_z),
                     static_cast<float>(1 / relief.width), static_cast<float>(1 / largest)};
  openness = ground_openness(relief);
  glBindTexture(GL_TEXTURE_2D, device->occlusion);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, Relief::size, Relief::size, GL_RED, GL_FLOAT, openness.data());
}

/// The bodies as the ground sees them, and as the sky does, from straight below and above.
void Renderer::Implementation::draw_relief(std::span<const Coordinates> poses, double low_x, double low_z,
                                           double high, Relief& relief) {
  depths.resize(relief.lowest.size());
  glEnable(GL_DEPTH_CLAMP);
  for (const bool from_below : {true, false}) {
    device->relief.start_anew();
    glm::dmat4 clip(0);
    clip[0][0] = 2 / relief.width;
    clip[2][1] = 2 / relief.width;
    clip[1][2] = (from_below ? 2 : -2) / high;
    clip[3] = {-1 - low_x * clip[0][0], -1 - low_z * clip[2][1], (from_below ? -1 : 1) - ground * clip[1][2],
               1};
    draw_solid(device->depth_program, clip, poses, from_below ? GL_BACK : GL_FRONT);
    glReadPixels(0, 0, Relief::size, Relief::size, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const bool is_there = depths[i] < 1;
      const auto height = static_cast<float>(high) * (from_below ? depths[i] : 1 - depths[i]);
      if (from_below) {
        relief.lowest[i] = height;
      } else {
        relief.highest[i] = is_there ? height : -1.0F;
      }
    }
  }
  glDisable(GL_DEPTH_CLAMP);
}

/// Away from shadows and from what stands close to the ground, less is to be computed for the same light.
GroundAreas Renderer::Implementation::ground_areas_of_tile() const {
  // Take the maps' columns of the ground's x and z.
  const glm::dmat4 map(frame.shadow_from_world);
  const glm::dvec4 middle = map * glm::dvec4(0, ground, 0, 1);
  const glm::dmat3 shadow_place(glm::dvec3(map[0].x, map[0].y, map[0].w),
                                glm::dvec3(map[2].x, map[2].y, map[2].w),
                                glm::dvec3(middle.x, middle.y, middle.w));
  const std::vector<float>& around = shadow->around();
  const MarkedCells in_shadow(ShadowMap::blocks, shadow_place,
                              [&](std::size_t i) { return settings.shadows && around[i] < 1; });
  const glm::dvec4 square(frame.occlusion);
  const glm::dmat3 square_place(glm::dvec3(square.z, 0, 0), glm::dvec3(0, square.z, 0),
                                glm::dvec3(-square.x * square.z, -square.y * square.z, 1));
  const MarkedCells occluded(Relief::size, square_place, [&](std::size_t i) { return openness[i] < 1; });
  return ground_areas(glm::dvec3(frame.eye), frame.eye.y - ground, glm::dvec3(frame.ray_corner),
                      glm::dvec3(frame.ray_right), glm::dvec3(frame.ray_up), picture.width, picture.height,
                      in_shadow, occluded);
}

}  // namespace substep::render
