#pragma once
/// The sources of all shaders.
///
/// For the same pixels on every machine shaders use no derivatives, pow or exp, and encode sRGB themselves:
/// an sRGB framebuffer encodes with an approximate root that differs between processors.

#include <array>
#include <compare>
#include <cstddef>
#include <string>

namespace substep::render::shaders {

/// Functions for sky, ground, scattered light and the film's curve, with LOOKS also for lamps. Shared with
/// WebGL, which declares to_sun and key, and sun, zenith, horizon and bounce as vectors of three components.
extern const char* const optics_glsl;
/// Functions for textured surfaces, with the uniforms that set_surface() sets. Shared with WebGL.
extern const char* const looks_glsl;

/// The block Frame, the same for all pixels of a frame, with the layout of FrameUniforms.
extern const char* const frame_glsl;
/// Poses of bodies: blocks, and the attribute `body`, a body's number from first_body on.
extern const char* const poses_glsl;
/// The fractions of the key light that reach a surface, and of the sky's that reach the ground.
extern const char* const key_light_glsl;
/// Packs the surface at a sample into four words of two 15-bit fractions and signs each: a software
/// rasteriser writes and reads a component of a texture as slowly as it computes several.
extern const char* const packing_glsl;
/// The light of a pixel's samples.
extern const char* const shading_glsl;

/// The number of bodies whose poses the blocks ClipPoses and WorldPoses hold.
inline constexpr std::size_t bodies_at_once = 1024;

/// Light that bodies may block from the ground: none, the sky's, or the sun's too.
enum class Shade : char { none, sky, shadow };
inline constexpr std::array<Shade, 3> shades{Shade::none, Shade::sky, Shade::shadow};

/// A shader program by what it draws and the kind of scene.
struct Program {
  enum class Kind : char {
    body,     ///< bodies' surfaces as integers, with the depth
    look,     ///< like body, for surfaces with more than a colour
    shading,  ///< the light on surfaces, a pixel each: two colours, and which samples have them; see
              ///< RenderedPixels
    ground,   ///< a disc around the eye's foot
    sky,      ///< one triangle over everything, at the far end
    depth,    ///< bodies in the shadow map
    color,    ///< bodies in the colours of Renderer::draw_bodies()
  };

  Kind kind;
  Shade shade = Shade::none;
  bool looks = false;        ///< ground, shading: in the light of lamps, of surfaces with more than a colour
  bool shines = false;       ///< look, shading: with emission, crevices and alpha
  bool has_sun = true;       ///< shading
  bool may_discard = false;  ///< look, color: of surfaces that are cut or that light passes through
  std::array<bool, 5> has_texture{};  ///< look: by Surface::Role

  auto operator<=>(const Program&) const = default;
};

struct Sources {
  std::string vertex;
  std::string fragment;
};

Sources sources_of(const Program& program);

}  // namespace substep::render::shaders
