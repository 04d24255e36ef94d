#pragma once
/// Internal to Renderer: its state, and the steps of drawing a picture.

#include <functional>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <vector>

#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/device.h"
#include "render/ground.h"
#include "render/lighting.h"
#include "render/picture_areas.h"
#include "render/renderer.h"
#include "render/resolve.h"
#include "render/shadow_map.h"
#include "render/targets.h"
#include "render/textures.h"

namespace substep::render {

struct Renderer::Implementation {
  using Poses = std::span<const Coordinates>;
  enum class Bodies : char { all, of_world, moving };

  std::shared_ptr<Device> device = take_device();
  Objects objects;
  RenderSettings settings;
  BodyMesh mesh;
  View view;                      ///< of the whole picture
  View tile_view;                 ///< of the tile that is drawn
  glm::dmat4 clip_from_world{1};  ///< of the tile
  glm::dvec4 key{0, 1, 0, 0};     ///< FrameUniforms::key
  double ground = 0;              ///< height, m
  double focus = 0;               ///< distance of the nearest part's centre from the eye, m
  double sight = 0;  ///< distance from the eye, m, beyond which bodies cast no shadows and hide no sky
  std::vector<bool> scenery;    ///< of each part
  std::vector<float> openness;  ///< of the ground to the sky, in the frame that is drawn
  FrameUniforms frame{};

  ShadowMap* shadow = nullptr;           ///< the frame's: one of the device's
  GLuint body_array = 0;                 ///< vertex array
  std::array<GLuint, 2> pose_buffers{};  ///< in the picture and in the world
  Surfaces surfaces;                     ///< with four samples for each pixel if anti-aliased
  Target picture;
  LightingBuffer lighting;
  std::vector<Rectangle> areas;  ///< of the tile, that bodies lie within
  std::vector<float> depths;     ///< read last; kept, since new memory costs as much as reading

  // Ground and sky that no body shades, of the last view.
  std::optional<View> backdrop_view;
  std::vector<char> backdrop_tiles;  ///< marks of the drawn tiles
  std::vector<std::uint8_t> backdrop;

  bool looks = false;   ///< needs_looks(): the scene has textures, lamps or opacity
  bool shines = false;  ///< whether a surface is blended, emits light or has an occlusion texture
  std::vector<SurfaceTextures> textures;  ///< of each part
  Lamps lamps;
  Surfaces kept;   ///< the world's, as seen with kept_view
  View kept_view;  ///< of the last tile
  bool has_kept = false;
  std::vector<Part> moving;        ///< of bodies, but for the world's
  std::vector<Rectangle> moved;    ///< areas of moving bodies in the last drawing
  std::array<Surfaces, 2> layers;  ///< of blended surfaces, in turn: one is drawn behind the other

  Implementation(const Scene& scene, const RenderSettings& wanted,
                 std::span<const std::vector<Coordinates>> reference);

  ~Implementation();
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  // renderer.cpp
  void choose_view(const Scene& scene, std::span<const std::vector<Coordinates>> reference);
  void look_at(const View& seen);
  int samples() const { return settings.antialiasing ? 2 : 1; }  ///< a pixel's side
  Image in_tiles(const std::function<Image()>& draw_tile);
  std::vector<Rectangle> areas_seen();
  void light_surfaces(GLuint depth, std::span<const Rectangle> lit_areas);
  RenderedPixels rendered() const;
  Image draw_tile(Poses poses);
  Image draw(Poses poses);
  Image draw_colors(Poses poses);

  // renderer_bodies.cpp
  void upload_bodies();
  void set_poses(GLuint program, const glm::dmat4& clip, Poses poses, std::size_t first) const;
  void draw_batches(GLuint program, const glm::dmat4& clip, Poses poses, GLenum hidden = GL_BACK) const;
  void draw_parts(GLuint program, const glm::dmat4& clip, Poses poses,
                  const std::function<bool(std::size_t)>& shows) const;
  bool has(Surface::Opacity opacity) const;
  void draw_solid(shaders::Program::Kind kind, const glm::dmat4& clip, Poses poses, GLenum hidden = GL_BACK,
                  bool is_blended_too = false);
  void draw_surfaces(Poses poses);
  void draw_looks(Poses poses, Surface::Opacity opacity, bool is_behind, Bodies which);
  bool draw_layer(Poses poses, std::size_t index);
  Image draw_layers(Poses poses);

  // renderer_ground.cpp
  bool is_in_sight(const Coordinates& q) const;
  void fit_shadow(Poses poses);
  void fit_occlusion(Poses poses);
  void draw_relief(Poses poses, double low_x, double low_z, double high, Relief& relief);
  GroundAreas ground_areas_of_tile() const;
  void draw_ground() const;
  void draw_surroundings(shaders::Shade shade, std::span<const Rectangle> within);
  void complete_backdrop(std::span<const Rectangle> wanted);
  void copy_backdrop(std::span<const Rectangle> within);
};

}  // namespace substep::render
