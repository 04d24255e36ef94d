#include "render/shaders.h"

#include <fmt/format.h>

namespace substep::render::shaders {
namespace {

/// The ground: with SUNLIT, outside of shadows; with OPEN, also where no body hides the sky.
const char* const ground_glsl = R"(
out vec4 code;

/// The point at which the ray through a pixel meets the ground.
vec2 hit(vec2 pixel) {
  vec3 ray = ray_corner.xyz + pixel.x * ray_right.xyz + pixel.y * ray_up.xyz;
  return eye.xz + ray.xz * ((ground_color.w - eye.y) / min(ray.y, -1e-7));
}

void main() {
  // Positions come from the rays: exact far away, and the neighbours' give the pixel's footprint.
  vec2 xz = hit(gl_FragCoord.xy);
  vec2 dx = hit(gl_FragCoord.xy + vec2(1.0, 0.0)) - xz;
  vec2 dy = hit(gl_FragCoord.xy + vec2(0.0, 1.0)) - xz;
  vec2 footprint = max(abs(dx) + abs(dy), vec2(1e-5)) * 1.2;
  vec3 position = vec3(xz.x, ground_color.w, xz.y);
  vec3 color = patterned(ground_color.rgb, xz, footprint, ground_reach.z);
#ifdef SUNLIT
  float lit = 1.0;
#else
  float lit = key_light(position, vec3(0.0, 1.0, 0.0));
#endif
#ifdef OPEN
  float open = 1.0;
#else
  float open = openness(position, vec2(0.0));
#endif
  vec3 radiance = ground_light(color, position, lit, open);
  code = vec4(display(in_haze(radiance, position - eye.xyz, ground_reach.x, ground_reach.y)), 1.0);
}
)";

const char* const ground_vertex = R"(
layout(location = 0) in vec3 position;  // of the unit disc
void main() {
  vec3 world = vec3(eye.x, ground_color.w, eye.z) + ground_reach.w * position;
  gl_Position = clip_from_world * vec4(world, 1.0);
}
)";

const char* const screen_vertex = R"(
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";

const char* const sky_glsl = R"(
out vec4 code;
void main() {
  vec3 ray = ray_corner.xyz + gl_FragCoord.x * ray_right.xyz + gl_FragCoord.y * ray_up.xyz;
  code = vec4(display(sky_light(normalize(ray))), 1.0);
}
)";

const char* const look_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in vec2 finish;
layout(location = 4) in vec4 coordinates;
layout(location = 5) in vec4 tint;
layout(location = 6) in vec4 tangent;
layout(location = 7) in vec2 density;
out vec3 world_position;
out vec3 world_normal;
out vec4 base_color;
out vec2 metallic_roughness;
out vec4 places;
out vec4 world_tangent;
out vec2 places_per_metre;
void main() {
  mat4 world_from_body = world_from_bodies[int(body)];
  gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0);
  world_position = (world_from_body * vec4(position, 1.0)).xyz;
  world_normal = mat3(world_from_body) * normal;
  base_color = vec4(color, 1.0) * tint;
  metallic_roughness = finish;
  places = coordinates;
  world_tangent = vec4(mat3(world_from_body) * tangent.xyz, tangent.w);
  places_per_metre = density;
}
)";

/// An unlit surface has metallic 2; where nothing is drawn the output must be 0. With SHINES, a second output
/// has the emission and alpha, a third the fraction of the sky's light that reaches the surface. Without
/// MAY_DISCARD hidden pixels are rejected before this runs, if nearer surfaces are drawn first.
const char* const look_glsl = R"(
in vec3 world_position;
in vec3 world_normal;
in vec4 base_color;
in vec2 metallic_roughness;
in vec4 places;
in vec4 world_tangent;
in vec2 places_per_metre;
uniform vec4 sight;        // the eye; w: metres between samples a metre from it
uniform sampler2D nearer_depth;
uniform float is_behind;   // 1: only what lies behind nearer_depth
layout(location = 0) out ivec4 surface;
#ifdef SHINES
layout(location = 1) out vec4 emission_alpha;
layout(location = 2) out vec4 crevice;
#endif

/// Returns the logarithm to base 2, linear between powers of 2: off by up to 0.09, the same on every machine.
float logarithm(float x) {
  int bits = floatBitsToInt(max(x, 1e-20));
  return float((bits >> 23) - 127) + intBitsToFloat((bits & 0x7fffff) | 0x3f800000) - 1.0;
}

/// `metres`: between samples on the surface.
vec4 texel(sampler2D map, int role, float metres) {
  float density = image_offsets[role].z > 0.5 ? places_per_metre.y : places_per_metre.x;
  return textureLod(map, image_coordinates(role, places), logarithm(density * image_offsets[role].w * metres));
}

void main() {
#ifdef MAY_DISCARD
  if (!gl_FrontFacing && opacity.w < 0.5) discard;
  if (is_behind > 0.5 && gl_FragCoord.z <= texelFetch(nearer_depth, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(world_normal);
  vec3 to_eye = sight.xyz - world_position;
  float away = sqrt(dot(to_eye, to_eye));
  float slant = max(abs(dot(n, to_eye)) / away, 0.05);
  float metres = sight.w * away / sqrt(slant);

  vec4 color = base_color * TEXEL0(color_texture);
  float alpha = color.a * opacity.x;
#ifdef MAY_DISCARD
  if (alpha < opacity.y) discard;
#endif
  vec4 finish = TEXEL1(finish_texture);
#ifdef HAS_BUMPS
  n = bumped(n, world_tangent, TEXEL2(normal_texture).xyz);
#endif
  surface = packed_surface(side * n, metallic_roughness.y * finish.g, color.rgb,
                           emission.w > 0.5 ? 2.0 : metallic_roughness.x * finish.b);
#ifdef SHINES
  crevice = vec4(ambient_fraction(TEXEL3(occlusion_texture)));
  emission_alpha = vec4(emission.rgb * TEXEL4(emission_texture).rgb,
                        opacity.z > 0.5 ? alpha : 1.0);
#endif
}
)";

const char* const body_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in vec2 finish;
out vec4 normal_and_roughness;
out vec4 color_and_metallic;
void main() {
  gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0);
  normal_and_roughness = vec4(mat3(world_from_bodies[int(body)]) * normal, finish.y);
  color_and_metallic = vec4(color, finish.x);
}
)";

const char* const body_glsl = R"(
in vec4 normal_and_roughness;
in vec4 color_and_metallic;
layout(location = 0) out ivec4 surface;
void main() {
  float side = gl_FrontFacing ? 1.0 : -1.0;
  surface = packed_surface(side * normal_and_roughness.xyz, normal_and_roughness.w, color_and_metallic.rgb,
                           color_and_metallic.w);
}
)";

const char* const depth_vertex = R"(
layout(location = 0) in vec3 position;
void main() { gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0); }
)";

const char* const color_vertex = R"(
layout(location = 0) in vec3 position;
uniform int first_body;
flat out vec3 body_code;
#ifdef MAY_DISCARD
layout(location = 4) in vec4 coordinates;
layout(location = 5) in vec4 tint;
out vec4 places;
out float tint_alpha;
#endif
void main() {
  int code = first_body + int(body) + 1;
  body_code = vec3(code & 255, code >> 8 & 255, code >> 16 & 255) / 255.0;
  gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0);
#ifdef MAY_DISCARD
  places = coordinates;
  tint_alpha = tint.a;
#endif
}
)";

const char* const color_glsl = R"(
flat in vec3 body_code;
out vec4 code;
#ifdef MAY_DISCARD
in vec4 places;
in float tint_alpha;
#endif
void main() {
#ifdef MAY_DISCARD
  float alpha = textureLod(color_texture, image_coordinates(0, places), 0.0).a * tint_alpha * opacity.x;
  if (alpha < opacity.y) discard;
#endif
  code = vec4(body_code, 1.0);
}
)";

std::string defines_of(const Program& program) {
  std::string defines = fmt::format("#define BODIES {}\n", bodies_at_once);
  const auto define_if = [&](bool is_defined, const char* name) {
    if (is_defined) defines += fmt::format("#define {}\n", name);
  };
  define_if(program.looks, "LOOKS");
  define_if(program.shines, "SHINES");
  define_if(!program.has_sun, "NO_SUN");
  define_if(program.may_discard, "MAY_DISCARD");
  define_if(program.shade != Shade::shadow, "SUNLIT");
  define_if(program.shade == Shade::none, "OPEN");
  define_if(program.has_texture[2], "HAS_BUMPS");
  for (std::size_t role = 0; role < program.has_texture.size(); ++role) {
    defines +=
        fmt::format("#define TEXEL{0}(map) {1}\n", role,
                    program.has_texture[role] ? fmt::format("texel(map, {}, metres)", role) : "vec4(1.0)");
  }
  return defines;
}

}  // namespace

Sources sources_of(const Program& program) {
  const std::string defines = defines_of(program);
  const auto join = [&](auto... parts) { return (defines + ... + parts); };
  switch (program.kind) {
    case Program::Kind::body:
      return {join(poses_glsl, body_vertex), join(packing_glsl, body_glsl)};
    case Program::Kind::look:
      return {join(poses_glsl, look_vertex), join(looks_glsl, packing_glsl, look_glsl)};
    case Program::Kind::shading:
      return {join(frame_glsl, screen_vertex),
              join(frame_glsl, optics_glsl, key_light_glsl, packing_glsl, shading_glsl)};
    case Program::Kind::ground:
      return {join(frame_glsl, ground_vertex), join(frame_glsl, optics_glsl, key_light_glsl, ground_glsl)};
    case Program::Kind::sky:
      return {join(frame_glsl, screen_vertex), join(frame_glsl, optics_glsl, sky_glsl)};
    case Program::Kind::depth:
      return {join(poses_glsl, depth_vertex), "void main() {}\n"};
    case Program::Kind::color:
      return {join(poses_glsl, color_vertex), join(looks_glsl, color_glsl)};
  }
  return {};
}

}  // namespace substep::render::shaders
