#pragma once
/// Which texture unit holds what, and which binding each uniform block has.

#include "render/gl.h"

namespace substep::render {

enum Unit : GLint {
  shadow_depth_unit,
  shadow_test_unit,
  shadow_nearest_unit,
  occlusion_unit,
  depth_unit,
  surface_unit,
  emission_unit,
  crevice_unit,
  nearer_unit,
  surface_texture_unit,  ///< the first of five, by Surface::Role
};

/// Of uniform blocks: the frame's, and the bodies' places.
enum Block : GLuint { frame_block, clip_places_block, world_places_block };

}  // namespace substep::render
