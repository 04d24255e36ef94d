#pragma once
/// Declarations and functions that several shaders share.

#include <string>

namespace substep::render::shaders {

/// Returns the block Frame, the same for all pixels of a frame, with the layout of FrameUniforms.
std::string frame();

/// Where bodies stand, by blocks and attribute `body`, a body's number from first_body on.
std::string places();

/// The colour by which Renderer::draw_bodies() names the body.
std::string code();

/// optics(), how much of the key light reaches a surface, and how much of the sky's the ground.
std::string key_light();

/// Packs what is seen at a sample into four words of two 15-bit fractions and signs each: a software
/// rasteriser takes as long to write and read a component of a texture as to compute several.
std::string packing();

}  // namespace substep::render::shaders
