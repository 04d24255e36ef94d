// Draws ground and sky, and the maps of shadow and occlusion that light on the ground depends on.

#include <algorithm>

#include "render/renderer_implementation.h"

namespace substep::render {
namespace {

void copy_pixels(std::span<const Rectangle> areas, int width, int height,
                 const std::vector<std::uint8_t>& from, std::vector<std::uint8_t>& to) {
  for (const Rectangle& area : areas) {
    const int right = std::min(area.x + area.width, width);
    for (int y = area.y; y < std::min(area.y + area.height, height); ++y) {
      const std::size_t begin = 4 * (std::size_t{1} * y * width + area.x);
      std::copy_n(&from[begin], 4 * (right - area.x), &to[begin]);
    }
  }
}

}  // namespace

bool Renderer::Implementation::is_in_sight(const Coordinates& q) const {
  return is_drawable(q) && (q.linear - to_eigen(view.eye)).norm() < sight;
}

/// Fits the key light's view to the bodies in sight, chooses a shadow map, sets its uniforms and draws it.
void Renderer::Implementation::fit_shadow(Poses poses) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[part.body];
    if (scenery[i] || !is_in_sight(q)) continue;
    for (const Vector3& corner : part.corners_at(q)) points.push_back(to_glm(corner));
  }
  const ShadowView seen =
      key.w > 0 ? fit_lamp_view(glm::dvec3(key), points) : fit_sun_view(-glm::dvec3(key), points);
  frame.shadow_from_world = glm::mat4(seen.map_from_world);
  // Take the small map where its texels are finer than the pixels: the large one takes as long as the rest
  // of a small picture.
  const double pixel = focus * 2 * view.tangent_y / settings.height;
  const double width = seen.width * seen.far;
  shadow = &device->shadow(width / 512 < 0.75 * pixel ? 512 : 1024);
  frame.depth_terms.z = static_cast<float>(shadow->size);
  const double texel = width / shadow->size;
  const double bias = std::min(0.001, 0.002 * width) + 0.6 * texel;
  frame.shadow_scale = glm::dvec4(1 / seen.width, bias, seen.depth, settings.shadows ? 1 : 0);
  if (!settings.shadows) return;
  shadow->start();
  glEnable(GL_DEPTH_CLAMP);
  draw_solid(shaders::Program::Kind::depth, seen.clip_from_world, poses);
  glDisable(GL_DEPTH_CLAMP);
  shadow->finish();
}

/// Fits the occlusion map to the bodies in sight and computes the ground's openness.
void Renderer::Implementation::fit_occlusion(Poses poses) {
  Vector3 low = Vector3::Constant(infinity);
  Vector3 high = -low;
  double largest = 0.01;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[part.body];
    if (scenery[i] || !is_in_sight(q)) continue;
    const Vector3 centre = q.angular * part.centre() + q.linear;
    low = low.cwiseMin(centre);
    high = high.cwiseMax(centre);
    largest = std::max(largest, part.half_size().norm());
  }
  if (!(low.x() < infinity)) low = high = Vector3::Zero();
  Relief relief;
  relief.width = std::max(high.x() - low.x(), high.z() - low.z()) + 6 * largest;
  const double low_x = (low.x() + high.x() - relief.width) / 2;
  const double low_z = (low.z() + high.z() - relief.width) / 2;
  draw_relief(poses, low_x, low_z, std::max(high.y() + 2 * largest - ground, 0.1), relief);
  frame.occlusion = glm::dvec4(low_x, low_z, 1 / relief.width, 1 / largest);
  openness = ground_openness(relief);
  glBindTexture(GL_TEXTURE_2D, device->occlusion);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, Relief::size, Relief::size, GL_RED, GL_FLOAT, openness.data());
}

/// Measures the bodies' least and greatest heights over the square from (low_x, low_z) on, up to `high`, m.
void Renderer::Implementation::draw_relief(Poses poses, double low_x, double low_z, double high,
                                           Relief& relief) {
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
    draw_solid(shaders::Program::Kind::depth, clip, poses, from_below ? GL_BACK : GL_FRONT);
    glReadPixels(0, 0, Relief::size, Relief::size, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const auto height = static_cast<float>(high) * (from_below ? depths[i] : 1 - depths[i]);
      if (from_below) {
        relief.lowest[i] = height;
      } else {
        relief.highest[i] = depths[i] < 1 ? height : -1.0F;
      }
    }
  }
  glDisable(GL_DEPTH_CLAMP);
}

/// Returns the areas where the ground may be shadowed or occluded; elsewhere a cheaper shader gives the same
/// light.
GroundAreas Renderer::Implementation::ground_areas_of_tile() const {
  // Restrict the map's transform to points (x, z) of the ground.
  const glm::dmat4 map(frame.shadow_from_world);
  const glm::dvec4 middle = map * glm::dvec4(0, ground, 0, 1);
  const glm::dmat3 to_shadow_map(glm::dvec3(map[0].x, map[0].y, map[0].w),
                                 glm::dvec3(map[2].x, map[2].y, map[2].w),
                                 glm::dvec3(middle.x, middle.y, middle.w));
  const std::vector<float>& around = shadow->around;
  const MarkedCells in_shadow(ShadowMap::blocks, to_shadow_map,
                              [&](std::size_t i) { return settings.shadows && around[i] < 1; });
  const glm::dvec4 square(frame.occlusion);
  const glm::dmat3 to_square(glm::dvec3(square.z, 0, 0), glm::dvec3(0, square.z, 0),
                             glm::dvec3(-square.x * square.z, -square.y * square.z, 1));
  const MarkedCells occluded(Relief::size, to_square, [&](std::size_t i) { return openness[i] < 1; });
  return ground_areas(glm::dvec3(frame.eye), frame.eye.y - ground, glm::dvec3(frame.ray_corner),
                      glm::dvec3(frame.ray_right), glm::dvec3(frame.ray_up), picture.width, picture.height,
                      in_shadow, occluded);
}

/// Draws the ground alone with the program in use.
void Renderer::Implementation::draw_ground() const {
  // Let the scene's surfaces at the ground's height win the depth test.
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1, 8);
  glBindVertexArray(device->disc);
  glDrawArrays(GL_TRIANGLE_FAN, 0, device->disc_vertices);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

/// Draws ground and sky within areas, behind the target's depth.
void Renderer::Implementation::draw_surroundings(shaders::Shade shade, std::span<const Rectangle> within) {
  using Kind = shaders::Program::Kind;
  device->use({.kind = Kind::ground, .shade = shade, .looks = looks});
  glEnable(GL_SCISSOR_TEST);
  for (const Rectangle& area : within) {
    glScissor(area.x, area.y, area.width, area.height);
    draw_ground();
  }
  device->use({.kind = Kind::sky});
  glBindVertexArray(device->no_attributes);
  for (const Rectangle& area : within) {
    glScissor(area.x, area.y, area.width, area.height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDisable(GL_SCISSOR_TEST);
}

/// Draws the tiles of `wanted` that the backdrop lacks. Overwrites `picture`.
void Renderer::Implementation::complete_backdrop(std::span<const Rectangle> wanted) {
  const int columns = tiles_along(picture.width);
  if (tile_view != backdrop_view) {
    backdrop_view = tile_view;
    backdrop_tiles.assign(std::size_t{1} * columns * tiles_along(picture.height), 0);
    backdrop.resize(picture.pixels.size());
  }
  // Mark the missing tiles.
  constexpr char is_missing = 2;
  for (const Rectangle& area : wanted) {
    for (int y = area.y / area_tile; y < (area.y + area.height) / area_tile; ++y) {
      for (int x = area.x / area_tile; x < (area.x + area.width) / area_tile; ++x) {
        char& mark = backdrop_tiles[std::size_t{1} * y * columns + x];
        if (mark == 0) mark = is_missing;
      }
    }
  }
  const std::vector<Rectangle> missing = rectangles(backdrop_tiles, columns, is_missing);
  if (missing.empty()) return;
  picture.start_anew();
  draw_surroundings(shaders::Shade::none, missing);
  picture.read();
  copy_pixels(missing, picture.width, picture.height, picture.pixels, backdrop);
  std::ranges::replace(backdrop_tiles, is_missing, char{1});
}

/// Copies areas of the backdrop into the pixels that were read from the picture.
void Renderer::Implementation::copy_backdrop(std::span<const Rectangle> within) {
  copy_pixels(within, picture.width, picture.height, backdrop, picture.pixels);
}

}  // namespace substep::render
