#pragma once
/// Internal to Renderer: what it holds, and the steps of drawing a picture.

#include <functional>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "render/backdrop.h"
#include "render/body_buffers.h"
#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/device.h"
#include "render/frame_uniforms.h"
#include "render/ground.h"
#include "render/lamps.h"
#include "render/picture_areas.h"
#include "render/renderer.h"
#include "render/resolve.h"
#include "render/shadow_map.h"
#include "render/surface_programs.h"
#include "render/surface_textures.h"
#include "render/targets.h"

namespace substep::render {

struct Renderer::Implementation {
  Device* device = &take_device();
  RenderSettings settings;
  BodyMesh mesh;
  View view;                      ///< of the whole picture
  View tile_view;                 ///< of the tile that is drawn
  glm::dmat4 clip_from_world{1};  ///< of the tile
  glm::dvec4 key{0, 1, 0, 0};     ///< FrameUniforms::key
  double ground = 0;
  double focus = 0;  ///< how far from the eye the scene begins
  double sight = 0;  ///< farther from the eye than this, bodies neither cast shadows nor hide the sky
  std::vector<bool> scenery;    ///< of each part
  std::vector<float> openness;  ///< of the ground to the sky, in the frame that is drawn
  FrameUniforms frame{};

  ShadowMap* shadow = nullptr;  ///< the frame's: one of the device's
  BodyBuffers bodies;
  Surfaces surfaces;  ///< of four samples a pixel if anti-aliased
  Surfaces kept;      ///< the world's, as seen with kept_view
  View kept_view;     ///< of the last tile
  bool has_kept = false;
  std::vector<Part> moving;      ///< of bodies, but for the world's
  std::vector<Rectangle> moved;  ///< where they were when last drawn
  Target picture;
  Lit lit;
  // Where surfaces have more than a colour:
  SurfacePrograms* programs = nullptr;
  SurfaceTextures textures;
  bool shines = false;  ///< SurfacePrograms::shading()
  Lamps lamps;
  Layers layers;                 ///< where light passes through some
  std::vector<Rectangle> areas;  ///< of the tile, that bodies lie within
  std::vector<float> depths;     ///< what was read last; kept, for fresh memory costs as much as reading
  Backdrop backdrop;

  Implementation(const Scene& scene, const RenderSettings& wanted,
                 std::span<const std::vector<Coordinates>> reference);

  ~Implementation();
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void look_at(const View& seen);
  Image in_tiles(const std::function<Image()>& draw_tile);
  bool is_in_sight(const Coordinates& q) const;
  void fit_shadow(std::span<const Coordinates> poses);
  void fit_occlusion(std::span<const Coordinates> poses);
  void draw_relief(std::span<const Coordinates> poses, double low_x, double low_z, double high,
                   Relief& relief);
  void draw_pieces(GLuint program, const glm::dmat4& clip, std::span<const Coordinates> poses,
                   Surface::Opacity opacity);
  enum class Bodies : char { all, of_world, moving };
  void draw_looks(std::span<const Coordinates> poses, Surface::Opacity opacity, bool is_behind, Bodies which);
  void draw_solid(GLuint program, const glm::dmat4& clip, std::span<const Coordinates> poses,
                  GLenum hidden = GL_BACK);
  void draw_surfaces(std::span<const Coordinates> poses);
  void light_surfaces(GLuint depth, std::span<const Rectangle> lit_areas);
  std::vector<Rectangle> areas_seen();
  GroundAreas ground_areas_of_tile() const;
  Drawn drawn() const;
  bool has(Surface::Opacity opacity) const;
  bool draw_layer(std::span<const Coordinates> poses, std::size_t index);
  Image draw_layers(std::span<const Coordinates> poses);
  Image draw_tile(std::span<const Coordinates> poses);
  Image draw(std::span<const Coordinates> poses);
  Image draw_colors(std::span<const Coordinates> poses);
};

}  // namespace substep::render
