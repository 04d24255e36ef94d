#pragma once
/// What shaders are told of a whole frame.

#include <array>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "render/camera.h"
#include "render/gl.h"
#include "render/lamps.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// The block Frame of shader_terms.cpp, whose comments say what each is.
struct FrameUniforms {
  glm::mat4 clip_from_world;
  glm::mat4 shadow_from_world;
  glm::vec4 eye;
  glm::vec4 ray_corner;
  glm::vec4 ray_right;
  glm::vec4 ray_up;
  glm::vec4 key;
  glm::vec4 to_sun;
  glm::vec4 sun;
  glm::vec4 zenith;
  glm::vec4 horizon;
  glm::vec4 bounce;
  glm::vec4 ground_color;
  glm::vec4 ground_reach;
  glm::vec4 shadow_scale;
  glm::vec4 occlusion;
  glm::vec4 depth_terms;
};

/// Tells a program which texture units it reads.
void set_frame_units(GLuint program);

/// Sets sun, sky, ground at this height and the light that casts shadows, and returns it: FrameUniforms::key.
glm::dvec4 set_light(FrameUniforms& frame, const Scene& scene, const Lamps& lamps, double ground);

/// The view of a picture of width × height and how far the ground reaches, for a scene `focus` from the eye;
/// the map from the world to the picture.
glm::dmat4 set_view(FrameUniforms& frame, const View& view, int width, int height, bool antialiasing,
                    double focus);

}  // namespace substep::render
