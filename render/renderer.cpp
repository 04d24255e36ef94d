#include "render/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "render/renderer_implementation.h"
#include "sim/error.h"
#include "sim/math/floating_point.h"

namespace substep::render {
namespace {

using Kind = shaders::Program::Kind;

/// Returns the size drawn at once: software OpenGL has 16384 samples a side, two a pixel, of 60 bytes each.
std::array<int, 2> size_of_tile(const RenderSettings& settings) {
  constexpr int longest = 8192;
  constexpr std::int64_t most = 1 << 23;
  const bool is_one = settings.tile == 0 && settings.width <= longest && settings.height <= longest &&
                      static_cast<std::int64_t>(settings.width) * settings.height <= most;
  if (is_one) return {settings.width, settings.height};
  const int side = settings.tile == 0 ? 2048 : settings.tile;
  return {std::min(settings.width, side), std::min(settings.height, side)};
}

/// Returns whether the surface is blended, emits light or has an occlusion texture.
bool shines_or_shades(const Surface& surface) {
  return surface.opacity == Surface::Opacity::blended || surface.emission != std::array{0.0, 0.0, 0.0} ||
         surface.textures[Surface::occlusion_texture].image >= 0;
}

/// Returns how many of a pixel's four samples in a picture of twice the size show bodies other than the
/// world.
int covered_samples(const Image& bodies, int x, int y) {
  int count = 0;
  for (const int row : {2 * y, 2 * y + 1}) {
    for (const int column : {2 * x, 2 * x + 1}) {
      const std::uint8_t* const p = bodies.pixel(column, row);
      // Codes of Renderer::draw_bodies(): 0 is the sky, 1 the world.
      count += p[0] + 256 * p[1] + 65536 * p[2] > 1 ? 1 : 0;
    }
  }
  return count;
}

/// Blends `over` into `image` where bodies are.
void blend_bodies(Image& image, const Image& over, const Image& bodies, double strength) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double alpha = strength * covered_samples(bodies, x, y) / 4;
      if (alpha == 0) continue;
      std::uint8_t* const to = image.pixel(x, y);
      const std::uint8_t* const from = over.pixel(x, y);
      for (int c = 0; c < 3; ++c) {
        to[c] = static_cast<std::uint8_t>(std::lround(to[c] + alpha * (from[c] - to[c])));
      }
    }
  }
}

}  // namespace

Renderer::Implementation::Implementation(const Scene& scene, const RenderSettings& wanted,
                                         std::span<const std::vector<Coordinates>> reference)
    : settings(wanted), mesh(gather_body_mesh(scene)), looks(!mesh.looks.empty()) {
  check(settings);
  for (const Part& part : mesh.parts) scenery.push_back(is_scenery(part, mesh.parts));
  std::ranges::copy_if(mesh.parts, std::back_inserter(moving),
                       [](const Part& part) { return part.body != 0; });
  const std::vector<std::vector<Coordinates>> initial{initial_state(scene).q};
  choose_view(scene, reference.empty() ? initial : reference);
  ground = ground_height(scene, mesh.parts);

  const Context::Current current(device->context);
  upload_bodies();
  if (looks) {
    textures = upload_textures(objects, scene, mesh.surfaces);
    shines = std::ranges::any_of(mesh.surfaces, shines_or_shades);
    lamps = lamps_of(scene, mesh.parts);
  }
  key = set_light(frame, scene, lamps, ground);
  const auto [tile_width, tile_height] = size_of_tile(settings);
  surfaces = Surfaces(objects, tile_width * samples(), tile_height * samples(), shines);
  if (has(Surface::Opacity::blended)) layers = {Surfaces(objects, surfaces), Surfaces(objects, surfaces)};
  picture = Target(objects, tile_width, tile_height);
  lighting = LightingBuffer(objects, picture, shines);
  look_at(view);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    throw Error("software OpenGL reports error {} while being set up: is libosmesa6 of Mesa 22.3 installed?",
                error);
  }
}

Renderer::Implementation::~Implementation() {
  const Context::Current current(device->context);
  objects.end();
}

/// Chooses the view, and measures how far away the scene is: near and far planes and the ground's fading
/// follow.
void Renderer::Implementation::choose_view(const Scene& scene,
                                           std::span<const std::vector<Coordinates>> reference) {
  for (const std::vector<Coordinates>& poses : reference) {
    if (poses.size() != scene.bodies.size()) throw std::logic_error("one pose per body is needed");
  }
  const double aspect = static_cast<double>(settings.width) / settings.height;
  view = scene.camera ? view_from(*scene.camera, aspect) : automatic_view(mesh.parts, reference, aspect);
  if (scene.camera && settings.steps_back) view = stepped_back(view, mesh.parts, reference);
  double nearest = infinity;
  double farthest = 1;
  for (const Part& part : mesh.parts) {
    const Coordinates& q = reference.front()[part.body];
    const Vector3 centre = q.angular * part.centre() + q.linear;
    const double radius = part.half_size().norm();
    const double distance = (centre - to_eigen(view.eye)).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, std::min(distance + radius, 1e4));
  }
  focus = std::max(std::min(nearest, farthest), 0.1);
  // Limit the distance of bodies in the shadow map, which a lost body would stretch.
  sight = 3 * farthest;
}

/// Sets the view of the next tile: the whole picture's, or that of a part.
void Renderer::Implementation::look_at(const View& seen) {
  tile_view = seen;
  clip_from_world = set_view(frame, tile_view, picture.width, picture.height, settings.antialiasing, focus);
}

/// Returns the picture that `draw_tile` draws tile by tile. Tiles overlap, since pixels
/// average samples of their neighbours too.
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

/// Returns where bodies were drawn, within `areas`.
std::vector<Rectangle> Renderer::Implementation::areas_seen() {
  const Rectangle box = bounds_of(areas, picture.width, picture.height);
  const int side = samples();
  depths.resize(std::size_t{1} * side * box.width * side * box.height);
  if (depths.empty()) return {};
  glReadPixels(side * box.x, side * box.y, side * box.width, side * box.height, GL_DEPTH_COMPONENT, GL_FLOAT,
               depths.data());
  return seen_areas(depths, box, side);
}

/// Computes the light on what was drawn last, whose depth is given, within `lit_areas`.
void Renderer::Implementation::light_surfaces(GLuint depth, std::span<const Rectangle> lit_areas) {
  glBindFramebuffer(GL_FRAMEBUFFER, lighting.framebuffer);
  glViewport(0, 0, picture.width, picture.height);
  bind_texture(depth_unit, depth);
  glDepthFunc(GL_ALWAYS);
  device->use({.kind = Kind::shading, .looks = looks, .shines = shines, .has_sun = lamps.has_sun});
  glBindVertexArray(device->no_attributes);
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

/// Returns the pixels that were read last.
RenderedPixels Renderer::Implementation::rendered() const {
  return {picture.width, picture.height, samples(), picture.pixels, lighting.pixels[0], lighting.pixels[1]};
}

Image Renderer::Implementation::draw(Poses poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  if (looks) {
    set_lamps(device->use({.kind = Kind::shading, .looks = true, .shines = shines, .has_sun = lamps.has_sun}),
              lamps);
    for (const shaders::Shade shade : shaders::shades) {
      set_lamps(device->use({.kind = Kind::ground, .shade = shade, .looks = true}), lamps);
    }
  }
  fit_shadow(poses);
  fit_occlusion(poses);
  return in_tiles([&] { return draw_tile(poses); });
}

Image Renderer::Implementation::draw_tile(Poses poses) {
  glBindBuffer(GL_UNIFORM_BUFFER, device->frame_buffer);
  glBufferData(GL_UNIFORM_BUFFER, sizeof frame, &frame, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, frame_block, device->frame_buffer);
  draw_surfaces(poses);  // which binds textures, too
  areas = areas_of(mesh.parts, poses, clip_from_world, picture.width, picture.height);
  const std::vector<Rectangle> seen = areas_seen();
  bind_texture(shadow_nearest_unit, shadow->nearest);
  bind_texture(shadow_test_unit, shadow->depth);
  bind_texture(occlusion_unit, device->occlusion);
  bind_texture(surface_unit, surfaces.textures[0]);
  bind_texture(emission_unit, surfaces.textures[1]);
  bind_texture(crevice_unit, surfaces.textures[2]);
  bind_texture(shadow_depth_unit, shadow->depth);

  const GroundAreas ground_areas = ground_areas_of_tile();
  complete_backdrop(ground_areas.open);
  light_surfaces(surfaces.depth, seen);
  picture.start();
  draw_surroundings(shaders::Shade::sky, ground_areas.occluded);
  draw_surroundings(shaders::Shade::shadow, ground_areas.shadowed);
  picture.read();
  copy_backdrop(ground_areas.open);
  lighting.read(picture);
  return has(Surface::Opacity::blended) ? draw_layers(poses) : resolved(rendered());
}

Image Renderer::Implementation::draw_colors(Poses poses) {
  const Context::Current current(device->context);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  return in_tiles([&] {
    picture.start_anew();
    draw_solid(Kind::color, clip_from_world, poses, GL_BACK, true);
    // Draw the ground in the colour of the world, body 0.
    glm::dmat4 placement(1);
    placement[0][0] = placement[2][2] = frame.ground_reach.w;
    placement[3] = {view.eye.x, ground, view.eye.z, 1};
    const GLuint program = device->use({.kind = Kind::color});
    set_poses(program, clip_from_world * placement, std::array{Coordinates{}}, 0);
    draw_ground();
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
    throw Error("a picture of {}×{} is too large: ask for at most {} pixels, and {} each way", settings.width,
                settings.height, most, longest);
  }
}

Renderer::Renderer(const Scene& scene, const RenderSettings& settings,
                   std::span<const std::vector<Coordinates>> reference) {
  const DefaultFloatingPoint environment;
  implementation_ = std::make_unique<Implementation>(scene, settings, reference);
}
Renderer::~Renderer() = default;

const View& Renderer::view() const {
  return implementation_->view;
}
void Renderer::change_view(const View& view) {
  implementation_->view = view;
}

bool Renderer::moves_by(double pixels, std::span<const Coordinates> from,
                        std::span<const Coordinates> to) const {
  const Implementation& own = *implementation_;
  return render::moves_by(pixels, own.mesh.parts, from, to, clip_from_world(own.view, 1, 2),
                          own.settings.width, own.settings.height);
}

Image Renderer::draw(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw(poses);
}
Image Renderer::draw_bodies(std::span<const Coordinates> poses) {
  const DefaultFloatingPoint environment;
  return implementation_->draw_colors(poses);
}

Image strobe(const Scene& scene, const RenderSettings& settings,
             std::span<const std::vector<Coordinates>> moments) {
  RenderSettings finer = settings;
  finer.width *= 2;
  finer.height *= 2;
  finer.antialiasing = false;
  check(finer);
  Renderer renderer(scene, settings, moments);
  Renderer masks(scene, finer, moments);
  const Image last = renderer.draw(moments.back());
  Image image = last;
  constexpr double faintest = 0.3;
  constexpr double strongest = 0.8;
  const std::size_t earlier = moments.size() - 1;
  for (std::size_t k = 0; k < earlier; ++k) {
    const double fraction = earlier == 1 ? 0.5 : static_cast<double>(k) / static_cast<double>(earlier - 1);
    blend_bodies(image, renderer.draw(moments[k]), masks.draw_bodies(moments[k]),
                 faintest + fraction * (strongest - faintest));
  }
  blend_bodies(image, last, masks.draw_bodies(moments.back()), 1);
  return image;
}

}  // namespace substep::render
