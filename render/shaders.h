#pragma once
/// The sources of all shaders.
///
/// For the same pixels on every machine they use no derivatives, no pow or exp, and encode sRGB themselves:
/// an sRGB framebuffer is encoded with an approximate root that differs between processors.

#include <array>
#include <cstddef>
#include <string>

namespace substep::render::shaders {

/// The sky, what surfaces scatter, the ground's pattern and the film's curve, as functions: for these shaders
/// and for WebGL, where to_sun, sun, zenith, horizon and bounce are given as vectors of three components.
std::string optics();
/// The lights beside the sun, for both: uniforms light_count and those of Lamps.
std::string lamps();
/// What textures make of a surface, for both: the uniforms that SurfacePrograms::set_surface() sets.
std::string looks();

/// How many bodies' places the blocks ClipPlaces and WorldPlaces of shaders that draw bodies have.
inline constexpr std::size_t bodies_at_once = 1024;

/// The light that bodies take from the ground: none, a part of the sky's, or the sun's too.
enum class Shade : char { none, sky, shadow };
inline constexpr std::array<Shade, 3> shades{Shade::none, Shade::sky, Shade::shadow};

std::string body_vertex();
/// The bodies' surfaces as seen: an output of integers, which shading_fragment() takes as a texture, with the
/// depth.
std::string body_fragment();
/// The light on it, a pixel each, drawn with sky_vertex(): two colours, and which samples have them; see
/// Drawn.
std::string shading_fragment();

/// The same for surfaces with more than a colour, SurfacePrograms: a surface whose colour is its light is
/// metallic by 2, and where nothing was drawn the output must be 0. With `shines`, a second output has what
/// they shine with and their alpha, a third how much of the sky's light reaches them.
std::string look_vertex();
/// `has_texture`: by Surface::Role. `may_discard`: for surfaces that are cut or that light passes through;
/// others are cheaper without, where nearer ones are drawn first.
std::string look_fragment(const std::array<bool, 5>& has_texture, bool may_discard, bool shines);
std::string look_shading_fragment(bool shines, bool has_sun);
/// Depth, or the bodies' codes, of what is not cut away.
std::string cut_vertex();
std::string cut_fragment();

/// A disc around the eye's foot.
std::string ground_vertex();
std::string ground_fragment(Shade shade, bool with_lamps);

/// One triangle over everything, at the far end.
std::string sky_vertex();
std::string sky_fragment();

/// For the shadow map.
std::string depth_vertex();
std::string depth_fragment();
/// For Renderer::draw_bodies(). Uniform first_body.
std::string color_vertex();
std::string color_fragment();

}  // namespace substep::render::shaders
