#pragma once
/// Which texture unit holds what.

#include "render/gl.h"

namespace substep::render {

enum Unit : GLint {
  shadow_depth_unit,
  shadow_test_unit,
  shadow_nearest_unit,
  occlusion_unit,
  depth_unit,
  normal_unit,
  color_unit,
  emission_unit,
  crevice_unit,
  nearer_unit,
  surface_texture_unit,  ///< the first of five, by Surface::Role
};

}  // namespace substep::render
