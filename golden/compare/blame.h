#pragma once
/// Attributes the differing pixels of two pictures to bodies.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/image.h"

namespace substep::golden {

/// Where a body is seen in a picture, from an image of bodies (Renderer::draw_bodies). Body −1 is the sky, 0
/// the world with the ground.
struct BodyExtent {
  int body = 0;
  std::int64_t pixels = 0;
  int left = 0, top = 0, right = -1, bottom = -1;  ///< the box around them, both ends included
};

/// Returns the body that is seen at a pixel of an image of bodies.
int body_at(const render::Image& bodies, std::size_t pixel);

/// Returns the visible bodies, ascending.
std::vector<BodyExtent> body_extents(const render::Image& bodies);

struct BodyBlame {
  int body = 0;
  std::string name;            ///< "sky", "ground and world" or the body's
  std::int64_t differing = 0;  ///< pixels
  std::int64_t levels = 0;     ///< their differences in the channel that differs most, summed
  std::int64_t pixels = 0;     ///< where it is seen, in either picture
  bool is_gone = false;        ///< it was in the golden picture and is not drawn any more
};

struct Blame {
  std::int64_t foreground = 0;            ///< pixels that show a body other than the world, in either picture
  std::int64_t differing_foreground = 0;  ///< those of them that differ
  std::vector<BodyBlame> bodies;          ///< those with differing pixels, most levels first
  bool is_everywhere = false;  ///< most of what is seen differs: light, camera or sky, not one body
};

/// Attributes each differing pixel to the body that the expected picture shows there or, where that is sky or
/// world, to the body in the actual picture. `approved` is where bodies were when the golden picture was
/// made: one that is drawn no more takes the differing pixels of its box. All images have one size.
Blame blame(const render::Image& expected, const render::Image& actual, const render::Image& expected_bodies,
            const render::Image& actual_bodies, const std::vector<BodyExtent>& approved,
            const std::vector<std::string>& names);

}  // namespace substep::golden
