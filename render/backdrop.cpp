#include "render/backdrop.h"

#include <algorithm>

namespace substep::render {
namespace {

void copy_pixels(const Rectangle& area, int width, int height, const std::vector<std::uint8_t>& from,
                 std::vector<std::uint8_t>& to) {
  const int right = std::min(area.x + area.width, width);
  for (int y = area.y; y < std::min(area.y + area.height, height); ++y) {
    const std::size_t begin = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                   static_cast<std::size_t>(area.x));
    std::copy_n(&from[begin], 4 * (right - area.x), &to[begin]);
  }
}

}  // namespace

void draw_ground(const Device& device, GLuint program) {
  // The ground gives way to what the scene draws at its height.
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1, 8);
  glUseProgram(program);
  glBindVertexArray(device.disc);
  glDrawArrays(GL_TRIANGLE_FAN, 0, Device::disc_vertices);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

void draw_surroundings(const Device& device, GLuint ground_program, std::span<const Rectangle> areas) {
  glEnable(GL_SCISSOR_TEST);
  for (const Rectangle& area : areas) {
    glScissor(area.x, area.y, area.width, area.height);
    draw_ground(device, ground_program);
  }
  glUseProgram(device.sky_program);
  glBindVertexArray(device.nothing);
  for (const Rectangle& area : areas) {
    glScissor(area.x, area.y, area.width, area.height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDisable(GL_SCISSOR_TEST);
}

void Backdrop::complete(const Device& device, GLuint ground_program, const FrameUniforms& frame,
                        std::span<const Rectangle> areas, Target& picture) {
  const int columns = tiles_along(picture.width);
  const std::vector<glm::vec4> view{frame.eye, frame.ray_corner, frame.ray_right, frame.ray_up};
  if (view != view_) {
    view_ = view;
    is_known_.assign(
        static_cast<std::size_t>(columns) * static_cast<std::size_t>(tiles_along(picture.height)), 0);
    pixels_.resize(picture.pixels.size());
  }
  // Mark the tiles of `areas` that are missing.
  constexpr char is_missing = 2;
  for (const Rectangle& area : areas) {
    for (int y = area.y / area_tile; y < (area.y + area.height) / area_tile; ++y) {
      for (int x = area.x / area_tile; x < (area.x + area.width) / area_tile; ++x) {
        char& known = is_known_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                                static_cast<std::size_t>(x)];
        if (known == 0) known = is_missing;
      }
    }
  }
  const std::vector<Rectangle> missing = rectangles(is_known_, columns, is_missing);
  if (missing.empty()) return;
  picture.start_anew();
  draw_surroundings(device, ground_program, missing);
  picture.read();
  for (const Rectangle& area : missing)
    copy_pixels(area, picture.width, picture.height, picture.pixels, pixels_);
  std::ranges::replace(is_known_, is_missing, char{1});
}

void Backdrop::copy(std::span<const Rectangle> areas, Target& picture) const {
  for (const Rectangle& area : areas)
    copy_pixels(area, picture.width, picture.height, pixels_, picture.pixels);
}

}  // namespace substep::render
