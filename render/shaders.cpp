#include "render/shaders.h"

#include <fmt/format.h>

#include "render/shader_terms.h"

namespace substep::render::shaders {
namespace {

/// With LOOKS, in all lights. With SUNLIT, outside of shadows; with OPEN, where no body takes skylight from
/// it either.
const std::string ground = R"(
out vec4 code;

/// Where the ray through a pixel meets the ground.
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

  vec2 checker = turns(xz, footprint);
  vec2 joint = lines(xz, footprint, 0.008);
  vec2 fine = lines(xz * 10.0, footprint * 10.0, 0.016);
  float joints = joint.x + joint.y - joint.x * joint.y;
  float fines = fine.x + fine.y - fine.x * fine.y;
  vec3 color = ground_color.rgb * (1.0 + 0.045 * checker.x * checker.y);
  color *= 1.0 - 0.30 * joints;
  color *= 1.0 - 0.16 * fines * ground_reach.z;

  vec3 n = vec3(0.0, 1.0, 0.0);
#ifdef SUNLIT
  float lit = 1.0;
#else
  float lit = key_light(position, n);
#endif
#ifdef OPEN
  float open = 1.0;
#else
  float open = openness(position, vec2(0.0));
#endif
  vec3 sky = mix(zenith.rgb, horizon.rgb, 0.55);
  vec3 radiance = color * (sun.rgb * (max(to_sun.y, 0.0) * (SUN_IS_KEY ? lit : 1.0)) + sky * open);
#ifdef LOOKS
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, position, lit, towards);
    radiance += color * light * max(towards.y, 0.0);
  }
#endif

  vec3 away = position - eye.xyz;
  float distance = length(away);
  float fade = clamp((distance - ground_reach.x) / (ground_reach.y - ground_reach.x), 0.0, 1.0);
  fade = 1.0 - square(1.0 - fade);
  vec3 level = normalize(vec3(away.x, 0.0, away.z));
  code = vec4(display(mix(radiance, sky_light(level), fade)), 1.0);
}
)";

}  // namespace

std::string look_vertex() {
  return places() + R"(
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
}

/// What look_fragment() is given, and what it says of a sample.
std::string look_declarations() {
  return looks() + packing() + R"(
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
)";
}

std::string look_fragment(const std::array<bool, 5>& has_texture, bool may_discard, bool shines) {
  std::string defines = may_discard ? "#define MAY_DISCARD\n" : "";
  if (shines) defines += "#define SHINES\n";
  if (has_texture[2]) defines += "#define HAS_BUMPS\n";
  for (std::size_t role = 0; role < has_texture.size(); ++role) {
    defines += fmt::format("#define TEXEL{0}(map) {1}\n", role,
                           has_texture[role] ? fmt::format("texel(map, {}, metres)", role) : "vec4(1.0)");
  }
  return defines + look_declarations() + R"(
/// The logarithm to base 2, by lines between the powers: exact on every machine, off by at most 0.09.
float logarithm(float x) {
  int bits = floatBitsToInt(max(x, 1e-20));
  return float((bits >> 23) - 127) + intBitsToFloat((bits & 0x7fffff) | 0x3f800000) - 1.0;
}

/// `metres`: between samples on the surface.
vec4 texel(sampler2D map, int role, float metres) {
  float density = image_offsets[role].z > 0.5 ? places_per_metre.y : places_per_metre.x;
  return textureLod(map, place_in_image(role, places), logarithm(density * image_offsets[role].w * metres));
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
  crevice = vec4(open_part(TEXEL3(occlusion_texture)));
  emission_alpha = vec4(emission.rgb * TEXEL4(emission_texture).rgb,
                        opacity.z > 0.5 ? alpha : 1.0);
#endif
}
)";
}

std::string cut_vertex() {
  return places() + code() + R"(
layout(location = 0) in vec3 position;
layout(location = 4) in vec4 coordinates;
layout(location = 5) in vec4 tint;
out vec4 places;
out float tint_alpha;
void main() {
  body_code = code_of_body();
  gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0);
  places = coordinates;
  tint_alpha = tint.a;
}
)";
}

std::string cut_fragment() {
  return looks() + R"(
in vec4 places;
in float tint_alpha;
flat in vec3 body_code;
out vec4 code;
void main() {
  float alpha = textureLod(color_texture, place_in_image(0, places), 0.0).a * tint_alpha * opacity.x;
  if (alpha < opacity.y) discard;
  code = vec4(body_code, 1.0);
}
)";
}

std::string body_vertex() {
  return places() + R"(
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
}

std::string body_fragment() {
  return packing() + R"(
in vec4 normal_and_roughness;
in vec4 color_and_metallic;
layout(location = 0) out ivec4 surface;
void main() {
  float side = gl_FrontFacing ? 1.0 : -1.0;
  surface = packed_surface(side * normal_and_roughness.xyz, normal_and_roughness.w, color_and_metallic.rgb,
                           color_and_metallic.w);
}
)";
}

std::string ground_vertex() {
  return frame() + R"(
layout(location = 0) in vec3 position;  // of the unit disc
void main() {
  vec3 world = vec3(eye.x, ground_color.w, eye.z) + ground_reach.w * position;
  gl_Position = clip_from_world * vec4(world, 1.0);
}
)";
}

std::string ground_fragment(Shade shade, bool with_lamps) {
  const std::string sunlit = shade == Shade::shadow ? "" : "#define SUNLIT\n";
  const std::string open = shade == Shade::none ? "#define OPEN\n" : "";
  return sunlit + open + (with_lamps ? "#define LOOKS\n" : "") + frame() + key_light() +
         (with_lamps ? lamps() : "") + ground;
}

std::string sky_vertex() {
  return frame() + R"(
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";
}

std::string sky_fragment() {
  return frame() + key_light() + R"(
out vec4 code;
void main() {
  vec3 ray = ray_corner.xyz + gl_FragCoord.x * ray_right.xyz + gl_FragCoord.y * ray_up.xyz;
  code = vec4(display(sky_light(normalize(ray))), 1.0);
}
)";
}

std::string depth_vertex() {
  return places() + R"(
layout(location = 0) in vec3 position;
void main() { gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0); }
)";
}

std::string color_vertex() {
  return places() + code() + R"(
layout(location = 0) in vec3 position;
void main() {
  gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0);
  body_code = code_of_body();
}
)";
}

std::string depth_fragment() {
  return "void main() {}\n";
}

std::string color_fragment() {
  return R"(
flat in vec3 body_code;
out vec4 code;
void main() { code = vec4(body_code, 1.0); }
)";
}

}  // namespace substep::render::shaders
