#pragma once
/// Ground and sky behind the bodies.

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "render/device.h"
#include "render/frame_uniforms.h"
#include "render/picture_areas.h"
#include "render/targets.h"

namespace substep::render {

/// Draws the ground alone, with `program`.
void draw_ground(const Device& device, GLuint program);

/// Draws ground and sky where the target's depth lets them through, within `areas`.
void draw_surroundings(const Device& device, GLuint ground_program, std::span<const Rectangle> areas);

/// Ground and sky that no body shades, of pictures of one size: drawn once a view, and kept.
class Backdrop {
 public:
  /// Draws what is missing of `areas` for the frame's view, without bodies, into `picture`, whose content is
  /// lost.
  void complete(const Device& device, GLuint ground_program, const FrameUniforms& frame,
                std::span<const Rectangle> areas, Target& picture);

  /// Copies `areas` into the pixels that were read from a picture.
  void copy(std::span<const Rectangle> areas, Target& picture) const;

 private:
  std::vector<glm::vec4> view_;  ///< the eye and the rays of pixels
  std::vector<char> is_known_;   ///< of tiles
  std::vector<std::uint8_t> pixels_;
};

}  // namespace substep::render
