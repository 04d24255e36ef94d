#pragma once
/// The sources of all shaders.
///
/// For the same pixels on every machine they use no derivatives, no pow or exp, and encode sRGB themselves:
/// an sRGB framebuffer is encoded with an approximate root that differs between processors.

#include <string>

namespace substep::shaders {

std::string body_vertex();  ///< uniforms clip_from_body, world_from_body
std::string body_fragment();
std::string ground_vertex();  ///< a disc around the eye's foot
std::string ground_fragment();
std::string sky_vertex();  ///< one triangle over everything, at the far end
std::string sky_fragment();
std::string depth_vertex();  ///< uniform clip_from_body: for the shadow map and the bodies' colours
std::string depth_fragment();
std::string color_fragment();  ///< uniform color

}  // namespace substep::shaders
