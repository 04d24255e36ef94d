#pragma once
/// Compiled and linked shaders.

#include <string>

#include "render/gl.h"

namespace substep::render {

/// Sources without their version line. Throws std::logic_error with the compiler's words: our own shaders are
/// at fault then.
GLuint make_program(const std::string& vertex, const std::string& fragment);

}  // namespace substep::render
