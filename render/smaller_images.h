#pragma once
/// A scene whose images take few bytes: for a page that holds them.

#include <cstddef>
#include <span>

#include "sim/scene/scene.h"

namespace substep::render {

struct ImageLimits {
  int longest = 512;            ///< pixels a side
  std::size_t bytes = 2000000;  ///< of all images' files together
};

/// The scene with those of its images that `surfaces` show within the limits: halved until they are, the
/// largest first where together they have too many bytes, though none below 16 pixels. Images that are small
/// stay the files that they were. Throws Error where one is damaged.
Scene with_smaller_images(const Scene& scene, std::span<const Surface> surfaces, const ImageLimits& limits);

}  // namespace substep::render
