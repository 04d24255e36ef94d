#pragma once
/// The numbers of texture units, and the bindings of uniform blocks.

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

/// Bindings of uniform blocks: the frame's, and the bodies' poses.
enum Block : GLuint { frame_block, clip_places_block, world_places_block };

}  // namespace substep::render
