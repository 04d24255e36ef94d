// Included first, since osmesa.h includes OpenGL's headers without the prototypes.
#include "render/gl.h"

#include <GL/osmesa.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include "render/renderer.h"
#include "sim/error.h"

namespace substep::render {
namespace {

struct OsMesa {
  decltype(&OSMesaCreateContextAttribs) create = nullptr;
  decltype(&OSMesaMakeCurrent) make_current = nullptr;
  decltype(&OSMesaDestroyContext) destroy = nullptr;
};

/// Loads the library, with the functions of gl.h, at the first call. The library stays loaded.
const OsMesa& osmesa() {
  static const OsMesa loaded = [] {
    void* const library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    const auto find = [&](auto& pointer, const char* name) {
      void* const found = library == nullptr ? nullptr : dlsym(library, name);
      if (found == nullptr) {
        throw Error("software OpenGL is not installed: on Debian 12, apt-get install libosmesa6 ({})",
                    dlerror());
      }
      pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(found);
    };
    OsMesa functions;
    find(functions.create, "OSMesaCreateContextAttribs");
    find(functions.make_current, "OSMesaMakeCurrent");
    find(functions.destroy, "OSMesaDestroyContext");
#define SUBSTEP_GL_FIND(name) find(name, #name);
    SUBSTEP_GL_FUNCTIONS(SUBSTEP_GL_FIND)
#undef SUBSTEP_GL_FIND
    return functions;
  }();
  return loaded;
}

/// Variables of the environment that change the pixels of Mesa 22.3's llvmpipe: with one of these set it is
/// another renderer.
constexpr std::array switches{"GALLIUM_NOSSE",
                              "GALLIVM_PERF",
                              "GALLIVM_DEBUG",
                              "LP_PERF",
                              "LP_DEBUG",
                              "LP_NO_RAST",
                              "DRAW_FSE",
                              "DRAW_NO_FSE",
                              "MESA_EXTENSION_OVERRIDE",
                              "MESA_GL_VERSION_OVERRIDE"};

/// Throws Error where vertices would be computed without LLVM, over which llvmpipe crashes.
void refuse_interpreted_vertices() {
  const char* value = std::getenv("DRAW_USE_LLVM");
  if (value == nullptr) return;
  const std::string_view text = value;
  if (text == "1" || text == "true" || text == "yes" || text == "y" || text == "t") return;
  throw Error("DRAW_USE_LLVM={}: software OpenGL crashes with it: unset it", text);
}

/// The samplers of the shaders, by Unit.
constexpr std::array samplers{"shadow_depth",      "shadow_test",     "shadow_nearest", "occlusion_map",
                              "sample_depth",      "packed_surfaces", "emission_alpha", "crevices",
                              "nearer_depth",      "color_texture",   "finish_texture", "normal_texture",
                              "occlusion_texture", "emission_texture"};

/// The uniform blocks of the shaders, by Block.
constexpr std::array blocks{"Frame", "ClipPoses", "WorldPoses"};

/// Throws std::logic_error where a shader or program was not made, with its log.
template <typename GetNumber, typename GetLog>
void require_success(GLuint object, GLenum status, GetNumber get_number, GetLog get_log) {
  GLint success = 0;
  get_number(object, status, &success);
  if (success != GL_FALSE) return;
  std::string log(4096, '\0');
  get_log(object, static_cast<GLsizei>(log.size()), nullptr, log.data());
  throw std::logic_error(std::string("shader: ") + log.c_str());
}

}  // namespace

Context::Context() {
  constexpr std::array<std::array<int, 2>, 6> attributes{{{OSMESA_FORMAT, OSMESA_RGBA},
                                                          {OSMESA_DEPTH_BITS, 0},
                                                          {OSMESA_PROFILE, OSMESA_CORE_PROFILE},
                                                          {OSMESA_CONTEXT_MAJOR_VERSION, 3},
                                                          {OSMESA_CONTEXT_MINOR_VERSION, 3},
                                                          {0, 0}}};
  refuse_interpreted_vertices();
  context_ = osmesa().create(attributes[0].data(), nullptr);
  if (context_ == nullptr) {
    throw Error(
        "software OpenGL gives no 3.3 core context: install libosmesa6 (Mesa 22.3 is what pictures are exact "
        "on)");
  }
}

Context::~Context() {
  osmesa().destroy(context_);
}

Context::Current::Current(Context& context) : lock_(context.mutex_) {
  if (osmesa().make_current(context.context_, context.pixel_.data(), GL_UNSIGNED_BYTE, 1, 1) != GL_TRUE)
    throw Error("software OpenGL (OSMesa) refuses its own context");
}

Context::Current::~Current() {
  osmesa().make_current(nullptr, nullptr, 0, 0, 0);
}

GLuint make_program(const std::string& vertex, const std::string& fragment) {
  const GLuint program = glCreateProgram();
  for (const auto& [kind, source] :
       {std::pair(GL_VERTEX_SHADER, &vertex), std::pair(GL_FRAGMENT_SHADER, &fragment)}) {
    const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
    const std::string whole = "#version 330 core\n" + *source;
    const char* text = whole.c_str();
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    require_success(shader, GL_COMPILE_STATUS, glGetShaderiv, glGetShaderInfoLog);
    glAttachShader(program, shader);
    // The shader lives on as a part of the program.
    glDeleteShader(shader);
  }
  glLinkProgram(program);
  require_success(program, GL_LINK_STATUS, glGetProgramiv, glGetProgramInfoLog);
  for (GLuint block = 0; block < blocks.size(); ++block) {
    const GLuint index = glGetUniformBlockIndex(program, blocks[block]);
    if (index != GL_INVALID_INDEX) glUniformBlockBinding(program, index, block);
  }
  glUseProgram(program);
  for (std::size_t unit = 0; unit < samplers.size(); ++unit) {
    glUniform1i(glGetUniformLocation(program, samplers[unit]), static_cast<GLint>(unit));
  }
  return program;
}

void bind_texture(GLint unit, GLuint texture) {
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture);
}

void pin_renderer() {
  // A machine with fused multiply-add or wider vectors rounds differently; these give the same bits on all.
  ::setenv("GALLIUM_DRIVER", "llvmpipe", 1);
  ::setenv("GALLIUM_OVERRIDE_CPU_CAPS", "sse4.1", 1);
  ::setenv("LP_NATIVE_VECTOR_WIDTH", "128", 1);
  ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
}

std::string renderer_description() {
  static const std::string description = [] {
    Context context;
    const Context::Current current(context);
    const auto text = [](GLenum name) {
      const GLubyte* value = glGetString(name);
      return std::string(value == nullptr ? "?" : reinterpret_cast<const char*>(value));
    };
    std::string description_here = text(GL_RENDERER) + ", " + text(GL_VERSION);
    for (const char* name : switches) {
      const char* value = std::getenv(name);
      if (value != nullptr) description_here += fmt::format(", {}={}", name, value);
    }
    return description_here;
  }();
  return description;
}

bool is_pinned_renderer() {
  const char* caps = std::getenv("GALLIUM_OVERRIDE_CPU_CAPS");
  return caps != nullptr && std::string_view(caps) == "sse4.1" &&
         renderer_description() == "llvmpipe (LLVM 15.0.6, 128 bits), 4.5 (Core Profile) Mesa 22.3.6";
}

}  // namespace substep::render
