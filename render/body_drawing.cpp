#include <algorithm>
#include <array>
#include <cstdint>

#include "render/gl.h"
#include "render/renderer_implementation.h"
#include "render/units.h"

namespace substep::render {

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
    surfaces.start();
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
    surfaces.start();
    surfaces.clear();
    draw(Bodies::all);
    return;
  }
  if (!has_kept) {
    if (kept.framebuffer == 0) kept = Surfaces(surfaces.width, surfaces.height, false);
    kept.start();
    kept.clear();
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

}  // namespace substep::render
