// First: osmesa.h includes OpenGL's headers without the prototypes.
#include "render/gl.h"

#include <GL/osmesa.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>
#include <type_traits>

#include "render/context.h"
#include "render/renderer.h"
#include "sim/error.h"

namespace substep::render {
namespace {

struct OsMesa {
  decltype(&OSMesaCreateContextAttribs) create = nullptr;
  decltype(&OSMesaMakeCurrent) make_current = nullptr;
  decltype(&OSMesaDestroyContext) destroy = nullptr;
};

/// Loads it, with the functions of gl.h, at the first call. It stays loaded.
const OsMesa& osmesa() {
  static const OsMesa loaded = [] {
    void* const library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    const auto find = [&](auto& pointer, const char* name) {
      void* const found = library == nullptr ? nullptr : dlsym(library, name);
      if (found == nullptr) {
        throw Error(fmt::format(
            "software OpenGL is not installed: on Debian 12, apt-get install libosmesa6 ({})", dlerror()));
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

}  // namespace

struct Context::Handle {
  OSMesaContext context = nullptr;
  /// The default framebuffer, which nothing is drawn to but which must be there.
  std::array<std::uint8_t, 4> pixel{};

  ~Handle() {
    if (context != nullptr) osmesa().destroy(context);
  }
};

namespace {

/// What else the environment can tell Mesa 22.3's llvmpipe that changes pixels: whoever sets one of these has
/// another renderer.
constexpr std::array<const char*, 10> switches{"GALLIUM_NOSSE",
                                               "GALLIVM_PERF",
                                               "GALLIVM_DEBUG",
                                               "LP_PERF",
                                               "LP_DEBUG",
                                               "LP_NO_RAST",
                                               "DRAW_FSE",
                                               "DRAW_NO_FSE",
                                               "MESA_EXTENSION_OVERRIDE",
                                               "MESA_GL_VERSION_OVERRIDE"};

/// Vertices without LLVM: llvmpipe crashes over it.
void refuse_interpreted_vertices() {
  const char* value = std::getenv("DRAW_USE_LLVM");
  if (value == nullptr) return;
  const std::string_view text = value;
  if (text == "1" || text == "true" || text == "yes" || text == "y" || text == "t") return;
  throw Error(fmt::format("DRAW_USE_LLVM={}: software OpenGL crashes with it: unset it", text));
}

}  // namespace

Context::Context() : handle_(std::make_unique<Handle>()) {
  const std::array<int, 13> attributes{OSMESA_FORMAT,
                                       OSMESA_RGBA,
                                       OSMESA_DEPTH_BITS,
                                       0,
                                       OSMESA_PROFILE,
                                       OSMESA_CORE_PROFILE,
                                       OSMESA_CONTEXT_MAJOR_VERSION,
                                       3,
                                       OSMESA_CONTEXT_MINOR_VERSION,
                                       3,
                                       0,
                                       0,
                                       0};
  refuse_interpreted_vertices();
  handle_->context = osmesa().create(attributes.data(), nullptr);
  if (handle_->context == nullptr) {
    throw Error(
        "software OpenGL gives no 3.3 core context: install libosmesa6 (Mesa 22.3 is what pictures are exact "
        "on)");
  }
}

Context::~Context() = default;

Context::Current::Current(Context& context) : lock_(context.mutex_), rounding_(std::fegetround()) {
  Handle& handle = *context.handle_;
  if (osmesa().make_current(handle.context, handle.pixel.data(), GL_UNSIGNED_BYTE, 1, 1) != GL_TRUE) {
    throw Error("software OpenGL (OSMesa) refuses its own context");
  }
  // Vertices are computed in this thread: another rounding mode changes pixels.
  std::fesetround(FE_TONEAREST);
}

Context::Current::~Current() {
  osmesa().make_current(nullptr, nullptr, 0, 0, 0);
  std::fesetround(rounding_);
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
