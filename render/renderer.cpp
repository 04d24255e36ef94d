#include "render/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/backdrop.h"
#include "render/body_buffers.h"
#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/device.h"
#include "render/frame_uniforms.h"
#include "render/gl.h"
#include "render/ground.h"
#include "render/lamps.h"
#include "render/picture_areas.h"
#include "render/resolve.h"
#include "render/shadow_map.h"
#include "render/surface_programs.h"
#include "render/surface_textures.h"
#include "render/targets.h"
#include "render/units.h"
#include "sim/error.h"
#include "sim/math/floating_point.h"

namespace substep::render {

namespace {

struct TileSize {
  int width;
  int height;
};

/// What is drawn at once: software OpenGL takes 16384 samples a side, and 60 bytes a sample.
TileSize size_of_tile(const RenderSettings& settings) {
  constexpr int longest = 8192;
  constexpr std::int64_t most = 1 << 23;
  const bool is_one = settings.tile == 0 && settings.width <= longest && settings.height <= longest &&
                      static_cast<std::int64_t>(settings.width) * settings.height <= most;
  if (is_one) return {settings.width, settings.height};
  const int side = settings.tile == 0 ? 2048 : settings.tile;
  return {std::min(settings.width, side), std::min(settings.height, side)};
}

/// Returns whether the surface shines, lets light through or is darker in its crevices.
bool shines_or_shades(const Surface& surface) {
  return surface.opacity == Surface::Opacity::blended || surface.emission != std::array{0.0, 0.0, 0.0} ||
         surface.textures[Surface::occlusion_texture].image >= 0;
}

}  // namespace

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

Renderer::Implementation::Implementation(const Scene& scene, const RenderSettings& wanted,
                                         std::span<const std::vector<Coordinates>> reference)
    : settings(wanted), mesh(gather_body_mesh(scene)) {
  check(settings);
  std::vector<std::vector<Coordinates>> initial;
  if (reference.empty()) {
    initial.push_back(initial_state(scene).q);
    reference = initial;
  }
  for (const std::vector<Coordinates>& poses : reference) {
    if (poses.size() != scene.bodies.size()) throw std::logic_error("one pose per body is needed");
  }
  for (const Part& part : mesh.parts) scenery.push_back(is_scenery(part, mesh.parts));
  std::ranges::copy_if(mesh.parts, std::back_inserter(moving),
                       [](const Part& part) { return part.body != 0; });
  const double aspect = static_cast<double>(settings.width) / settings.height;
  view = scene.camera && settings.steps_back
             ? stepped_back(view_from(*scene.camera, aspect), mesh.parts, reference)
         : scene.camera ? view_from(*scene.camera, aspect)
                        : automatic_view(mesh.parts, reference, aspect);
  ground = ground_height(scene, mesh.parts);

  // How far away the scene is, which near and far planes and the ground's fading follow.
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 1;
  for (const Part& part : mesh.parts) {
    const Coordinates& q = reference.front()[static_cast<std::size_t>(part.body)];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    const double radius = part.half_size().norm();
    const double distance = (centre - Vector3(view.eye.x, view.eye.y, view.eye.z)).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, std::min(distance + radius, 1e4));
  }
  if (!(nearest < farthest)) nearest = farthest;
  // One body that a run has lost must not stretch the shadow map until it shows nothing of the others.
  sight = 3 * farthest;

  const Context::Current current(device->context);
  bodies = BodyBuffers(mesh);
  if (!mesh.looks.empty()) {
    programs = &device->surface_programs();
    textures = SurfaceTextures(scene, mesh.surfaces);
    shines = std::ranges::any_of(mesh.surfaces, shines_or_shades);
    lamps = lamps_of(scene, mesh.parts);
  }
  key = set_light(frame, scene, lamps, ground);
  focus = std::max(nearest, 0.1);
  const int scale = settings.antialiasing ? 2 : 1;
  const auto [tile_width, tile_height] = size_of_tile(settings);
  surfaces = Surfaces(tile_width * scale, tile_height * scale, shines);
  if (has(Surface::Opacity::blended)) layers = Layers(surfaces);
  picture = Target(tile_width, tile_height);
  lit = Lit(picture, shines);
  look_at(view);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    throw Error("software OpenGL reports error " + std::to_string(error) +
                " while being set up: is libosmesa6 of Mesa 22.3 installed?");
  }
}

Renderer::Implementation::~Implementation() {
  {
    const Context::Current current(device->context);
    surfaces.end();
    kept.end();
    picture.end();
    lit.end();
    bodies.end();
    textures.end();
    layers.end();
  }
  give_back(*device);
}

/// What the next tile is to show: the whole picture, or a part of it.
void Renderer::Implementation::look_at(const View& seen) {
  tile_view = seen;
  clip_from_world = set_view(frame, tile_view, picture.width, picture.height, settings.antialiasing, focus);
}

/// The picture of what `draw_tile` draws of each tile, one after the other. Tiles lap over each other, for a
/// pixel is a mean of samples of its neighbours too.
Image Renderer::Implementation::in_tiles(const std::function<Image()>& draw_tile) {
  if (picture.width == settings.width && picture.height == settings.height) {
    look_at(view);
    return draw_tile();
  }
  constexpr int lap = 2;
  Image image(settings.width, settings.height);
  for (int top = 0, bottom = 0; top < settings.height; top = bottom) {
    const int y = std::clamp(top - lap, 0, settings.height - picture.height);
    bottom = y + picture.height == settings.height ? settings.height : y + picture.height - lap;
    for (int left = 0, right = 0; left < settings.width; left = right) {
      const int x = std::clamp(left - lap, 0, settings.width - picture.width);
      right = x + picture.width == settings.width ? settings.width : x + picture.width - lap;
      look_at(part_of(view, settings.width, settings.height, x, y, picture.width, picture.height));
      const Image drawn = draw_tile();
      for (int row = top; row < bottom; ++row) {
        std::copy_n(drawn.pixel(left - x, row - y), 3 * (right - left), image.pixel(left, row));
      }
    }
  }
  return image;
}

bool Renderer::Implementation::is_in_sight(const Coordinates& q) const {
  return is_drawable(q) && (q.linear - Vector3(view.eye.x, view.eye.y, view.eye.z)).norm() < sight;
}

/// Draws the map of what the light that casts shadows sees.
void Renderer::Implementation::fit_shadow(std::span<const Coordinates> poses) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    if (scenery[i] || !is_in_sight(q)) continue;
    for (const Vector3& corner : part.corners()) {
      const Vector3 p = q.angular * corner + q.linear;
      points.emplace_back(p.x(), p.y(), p.z());
    }
  }
  const ShadowView seen =
      key.w > 0 ? fit_lamp_view(glm::dvec3(key), points) : fit_sun_view(-glm::dvec3(key), points);
  frame.shadow_from_world = glm::mat4(seen.map_from_world);
  // The large map takes as long as all else of a small picture. The small one does where its texels are finer
  // than the pixels.
  const double pixel = focus * 2 * view.tangent_y / settings.height;
  const double width = seen.width * seen.far;
  shadow = &device->shadow(width / 512 < 0.75 * pixel);
  frame.depth_terms.z = static_cast<float>(shadow->size);
  const double texel = width / shadow->size;
  frame.shadow_scale = {static_cast<float>(1 / seen.width), static_cast<float>(0.001 + 0.6 * texel),
                        static_cast<float>(seen.depth), settings.shadows ? 1.0F : 0.0F};
  if (!settings.shadows) return;
  shadow->start();
  glEnable(GL_DEPTH_CLAMP);
  draw_solid(device->depth_program, seen.clip_from_world, poses);
  glDisable(GL_DEPTH_CLAMP);
  shadow->finish();
}

void Renderer::Implementation::fit_occlusion(std::span<const Coordinates> poses) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Vector3 low = Vector3::Constant(infinite);
  Vector3 high = -low;
  double largest = 0.01;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    const Coordinates& q = poses[static_cast<std::size_t>(part.body)];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    if (scenery[i] || !is_in_sight(q)) continue;
    low = low.cwiseMin(centre);
    high = high.cwiseMax(centre);
    largest = std::max(largest, part.half_size().norm());
  }
  if (!(low.x() < infinite)) low = high = Vector3::Zero();
  Relief relief;
  relief.width = std::max(high.x() - low.x(), high.z() - low.z()) + 6 * largest;
  const double low_x = (low.x() + high.x() - relief.width) / 2;
  const double low_z = (low.z() + high.z() - relief.width) / 2;
  draw_relief(poses, low_x, low_z, std::max(high.y() + 2 * largest - ground, 0.1), relief);
  frame.occlusion = {static_cast<float>(low_x), static_cast<float>(low_z),
                     static_cast<float>(1 / relief.width), static_cast<float>(1 / largest)};
  openness = ground_openness(relief);
  glBindTexture(GL_TEXTURE_2D, device->occlusion);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, Relief::size, Relief::size, GL_RED, GL_FLOAT, openness.data());
}

/// The bodies as the ground sees them, and as the sky does, from straight below and above.
void Renderer::Implementation::draw_relief(std::span<const Coordinates> poses, double low_x, double low_z,
                                           double high, Relief& relief) {
  depths.resize(relief.lowest.size());
  glEnable(GL_DEPTH_CLAMP);
  for (const bool from_below : {true, false}) {
    device->relief.start_anew();
    glm::dmat4 clip(0);
    clip[0][0] = 2 / relief.width;
    clip[2][1] = 2 / relief.width;
    clip[1][2] = (from_below ? 2 : -2) / high;
    clip[3] = {-1 - low_x * clip[0][0], -1 - low_z * clip[2][1], (from_below ? -1 : 1) - ground * clip[1][2],
               1};
    draw_solid(device->depth_program, clip, poses, from_below ? GL_BACK : GL_FRONT);
    glReadPixels(0, 0, Relief::size, Relief::size, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const bool is_there = depths[i] < 1;
      const auto height = static_cast<float>(high) * (from_below ? depths[i] : 1 - depths[i]);
      if (from_below) {
        relief.lowest[i] = height;
      } else {
        relief.highest[i] = is_there ? height : -1.0F;
      }
    }
  }
  glDisable(GL_DEPTH_CLAMP);
}

bool Renderer::Implementation::has(Surface::Opacity opacity) const {
  return std::ranges::any_of(mesh.surfaces,
                             [&](const Surface& surface) { return surface.opacity == opacity; });
}

void Renderer::Implementation::draw_pieces(GLuint program, const glm::dmat4& clip,
                                           std::span<const Coordinates> poses, Surface::Opacity opacity) {
  bodies.draw_pieces(mesh, program, clip, poses, [&](const Piece& piece) {
    const Surface& surface = mesh.surfaces[piece.surface];
    if (surface.opacity != opacity) return false;
    if (program == programs->cut) programs->set_surface(program, surface, textures, piece.surface);
    return true;
  });
}

/// Depth or colour alone of all that light does not pass through.
void Renderer::Implementation::draw_solid(GLuint program, const glm::dmat4& clip,
                                          std::span<const Coordinates> poses, GLenum hidden) {
  if (programs == nullptr) {
    bodies.draw(program, clip, poses, hidden);
    return;
  }
  draw_pieces(program, clip, poses, Surface::Opacity::opaque);
  if (has(Surface::Opacity::cut)) draw_pieces(programs->cut, clip, poses, Surface::Opacity::cut);
}

/// Draws what is seen of all bodies. Surfaces of the world, which take longest where they have textures, are
/// kept when a view is drawn a second time; then they are copied to where bodies were in the last frame.
void Renderer::Implementation::draw_surfaces(std::span<const Coordinates> poses) {
  if (programs == nullptr) {
    surfaces.start_anew();
    bodies.draw(device->body_program, clip_from_world, poses);
    return;
  }
  const auto draw = [&](Bodies which) {
    for (const Surface::Opacity opacity : {Surface::Opacity::opaque, Surface::Opacity::cut})
      draw_looks(poses, opacity, false, which);
  };
  if (shines || tile_view != kept_view) {
    has_kept = false;
    kept_view = tile_view;
    surfaces.start_anew();
    draw(Bodies::all);
    return;
  }
  if (!has_kept) {
    if (kept.framebuffer == 0) kept = Surfaces(surfaces.width, surfaces.height, false);
    kept.start_anew();
    draw(Bodies::of_world);
    moved = {{0, 0, picture.width, picture.height}};
    has_kept = true;
  }
  surfaces.copy(kept, moved, settings.antialiasing ? 2 : 1);
  draw(Bodies::moving);
  moved = areas_of(moving, poses, clip_from_world, picture.width, picture.height);
}

/// Draws surfaces as seen; with `is_behind`, those alone that lie behind nearer_unit's depth.
void Renderer::Implementation::draw_looks(std::span<const Coordinates> poses, Surface::Opacity opacity,
                                          bool is_behind, Bodies which) {
  const glm::vec4 eye = sight_of(tile_view, surfaces.height);
  bodies.draw_pieces(mesh, 0, clip_from_world, poses, [&](const Piece& piece) {
    const Surface& surface = mesh.surfaces[piece.surface];
    const bool is_asked_for = which == Bodies::all || (which == Bodies::of_world) == (piece.body == 0);
    if (surface.opacity != opacity || !is_asked_for) return false;
    programs->use_body(surface, textures, piece.surface, eye, is_behind, shines);
    return true;
  });
  glDisable(GL_CULL_FACE);
}

/// Where bodies were drawn, within `areas`.
std::vector<Rectangle> Renderer::Implementation::areas_seen() {
  const Rectangle box = bounds_of(areas, picture.width, picture.height);
  const int side = settings.antialiasing ? 2 : 1;
  depths.resize(static_cast<std::size_t>(side * box.width) * static_cast<std::size_t>(side * box.height));
  if (depths.empty()) return {};
  glReadPixels(side * box.x, side * box.y, side * box.width, side * box.height, GL_DEPTH_COMPONENT, GL_FLOAT,
               depths.data());
  return seen_areas(depths, box, side);
}

/// The light on what was drawn last, whose depth is given; it lies within `lit_areas`.
void Renderer::Implementation::light_surfaces(GLuint depth, std::span<const Rectangle> lit_areas) {
  glBindFramebuffer(GL_FRAMEBUFFER, lit.framebuffer);
  glViewport(0, 0, picture.width, picture.height);
  glActiveTexture(GL_TEXTURE0 + depth_unit);
  glBindTexture(GL_TEXTURE_2D, depth);
  glDepthFunc(GL_ALWAYS);
  glUseProgram(programs == nullptr ? device->shading_program : programs->shading(shines));
  glBindVertexArray(device->nothing);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_SCISSOR_TEST);
  for (const Rectangle& area : lit_areas) {
    glScissor(area.x, area.y, area.width, area.height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDisable(GL_SCISSOR_TEST);
  glDepthFunc(GL_LEQUAL);
}

/// Away from shadows and from what stands close to the ground, less is to be computed for the same light.
GroundAreas Renderer::Implementation::ground_areas_of_tile() const {
  // Of the ground's x and z: columns of the maps' matrices.
  const glm::dmat4 map(frame.shadow_from_world);
  const glm::dvec4 middle = map * glm::dvec4(0, ground, 0, 1);
  const glm::dmat3 shadow_place(glm::dvec3(map[0].x, map[0].y, map[0].w),
                                glm::dvec3(map[2].x, map[2].y, map[2].w),
                                glm::dvec3(middle.x, middle.y, middle.w));
  const std::vector<float>& around = shadow->around();
  const MarkedCells in_shadow(ShadowMap::blocks, shadow_place,
                              [&](std::size_t i) { return settings.shadows && around[i] < 1; });
  const glm::dvec4 square(frame.occlusion);
  const glm::dmat3 square_place(glm::dvec3(square.z, 0, 0), glm::dvec3(0, square.z, 0),
                                glm::dvec3(-square.x * square.z, -square.y * square.z, 1));
  const MarkedCells occluded(Relief::size, square_place, [&](std::size_t i) { return openness[i] < 1; });
  return ground_areas(glm::dvec3(frame.eye), frame.eye.y - ground, glm::dvec3(frame.ray_corner),
                      glm::dvec3(frame.ray_right), glm::dvec3(frame.ray_up), picture.width, picture.height,
                      in_shadow, occluded);
}

/// What was read last.
Drawn Renderer::Implementation::drawn() const {
  return {picture.width,  picture.height, settings.antialiasing ? 2 : 1,
          picture.pixels, lit.pixels[0],  lit.pixels[1]};
}

/// The nearest surfaces that light passes through, from the second layer on those behind the one before.
/// False where there are none.
bool Renderer::Implementation::draw_layer(std::span<const Coordinates> poses, std::size_t index) {
  const std::size_t turn = index % 2;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, surfaces.framebuffer);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, layers.surfaces[turn]);
  glBlitFramebuffer(0, 0, surfaces.width, surfaces.height, 0, 0, surfaces.width, surfaces.height,
                    GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, layers.surfaces[turn]);
  glViewport(0, 0, surfaces.width, surfaces.height);
  surfaces.clear();
  glActiveTexture(GL_TEXTURE0 + nearer_unit);
  glBindTexture(GL_TEXTURE_2D, layers.depths[1 - turn]);
  GLuint query = 0;
  glGenQueries(1, &query);
  glBeginQuery(GL_SAMPLES_PASSED, query);
  draw_looks(poses, Surface::Opacity::blended, index > 0, Bodies::all);
  glEndQuery(GL_SAMPLES_PASSED);
  GLuint passed = 0;
  glGetQueryObjectuiv(query, GL_QUERY_RESULT, &passed);
  glDeleteQueries(1, &query);
  if (passed == 0) return false;
  light_surfaces(layers.depths[turn], areas);
  lit.read(picture);
  return true;
}

/// The picture with what light passes through over all else: the nearest layers, and they from back to front.
Image Renderer::Implementation::draw_layers(std::span<const Coordinates> poses) {
  constexpr std::size_t most = 8;
  Veiled result = veiled(drawn());
  std::vector<std::array<std::vector<std::uint8_t>, 3>> layers_drawn;
  while (layers_drawn.size() < most && draw_layer(poses, layers_drawn.size())) {
    layers_drawn.push_back(lit.pixels);
  }
  for (auto layer = layers_drawn.rbegin(); layer != layers_drawn.rend(); ++layer) {
    Drawn over = drawn();
    over.first = (*layer)[0];
    over.second = (*layer)[1];
    lay_over(result, over, (*layer)[2]);
  }
  return resolved(result, picture.width, picture.height, drawn().samples);
}

Image Renderer::Implementation::draw(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  if (programs != nullptr) programs->set_lamps(lamps, shines);
  fit_shadow(poses);
  fit_occlusion(poses);
  return in_tiles([&] { return draw_tile(poses); });
}

Image Renderer::Implementation::draw_tile(std::span<const Coordinates> poses) {
  glEnable(GL_DEPTH_TEST);
  glBindBuffer(GL_UNIFORM_BUFFER, device->frame_buffer);
  glBufferData(GL_UNIFORM_BUFFER, sizeof frame, &frame, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, device->frame_buffer);
  draw_surfaces(poses);  // which binds textures, too
  areas = areas_of(mesh.parts, poses, clip_from_world, picture.width, picture.height);
  const std::vector<Rectangle> seen = areas_seen();
  const auto bind = [](GLint unit, GLuint texture) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  bind(shadow_nearest_unit, shadow->nearest());
  bind(shadow_test_unit, shadow->depth());
  bind(occlusion_unit, device->occlusion);
  bind(surface_unit, surfaces.textures[0]);
  bind(emission_unit, surfaces.textures[1]);
  bind(crevice_unit, surfaces.textures[2]);
  bind(shadow_depth_unit, shadow->depth());

  const auto ground_program = [&](shaders::Shade shade) {
    return (programs == nullptr ? device->ground_programs
                                : programs->ground)[static_cast<std::size_t>(shade)];
  };
  const GroundAreas ground_areas = ground_areas_of_tile();
  backdrop.complete(*device, ground_program(shaders::Shade::none), frame, ground_areas.open, picture);

  light_surfaces(surfaces.depth, seen);
  picture.start();
  draw_surroundings(*device, ground_program(shaders::Shade::sky), ground_areas.occluded);
  draw_surroundings(*device, ground_program(shaders::Shade::shadow), ground_areas.shadowed);
  picture.read();
  backdrop.copy(ground_areas.open, picture);
  lit.read(picture);
  return has(Surface::Opacity::blended) ? draw_layers(poses) : resolved(drawn());
}

Image Renderer::Implementation::draw_colors(std::span<const Coordinates> poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  return in_tiles([&] {
    picture.start_anew();
    draw_solid(device->color_program, clip_from_world, poses);
    if (has(Surface::Opacity::blended)) {
      draw_pieces(device->color_program, clip_from_world, poses, Surface::Opacity::blended);
    }
    // The ground is the world's.
    glm::dmat4 place(1);
    place[0][0] = place[2][2] = frame.ground_reach.w;
    place[3] = {view.eye.x, ground, view.eye.z, 1};
    glUseProgram(device->color_program);
    bodies.set_places(device->color_program, clip_from_world * place, std::array{Coordinates{}}, 0);
    draw_ground(*device, device->color_program);
    picture.read();
    return top_down(picture.pixels, picture.width, picture.height);
  });
}

void check(const RenderSettings& settings) {
  if (settings.width < 1 || settings.height < 1) throw Error("a picture needs at least one pixel each way");
  constexpr int longest = 1 << 15;
  constexpr std::int64_t most = 1 << 28;
  if (settings.width > longest || settings.height > longest ||
      static_cast<std::int64_t>(settings.width) * settings.height > most) {
    throw Error(fmt::format("a picture of {}×{} is too large: ask for at most {} pixels, and {} each way",
                            settings.width, settings.height, most, longest));
  }
}

Renderer::Renderer(const Scene& scene, const RenderSettings& settings,
                   std::span<const std::vector<Coordinates>> reference) {
  const DefaultFloatingPoint environment;
  implementation_ = std::make_unique<Implementation>(scene, settings, reference);
}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

const View& Renderer::view() const {
  return implementation_->view;
}
void Renderer::look(const View& view) {
  implementation_->view = view;
}

bool Renderer::moves_by(double pixels, std::span<const Coordinates> from,
                        std::span<const Coordinates> to) const {
  const RenderSettings& settings = implementation_->settings;
  return render::moves_by(pixels, implementation_->mesh.parts, from, to, clip_from_world(view(), 1, 2),
                          settings.width, settings.height);
}

Image Renderer::draw(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw(poses);
}
Image Renderer::draw_bodies(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw_colors(poses);
}

}  // namespace substep::render
