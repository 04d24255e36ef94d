#include "render/shaders.h"

namespace substep::render::shaders {

const char* const frame_glsl = R"(
layout(std140) uniform Frame {
  mat4 clip_from_world;
  mat4 shadow_from_world;  // x / w, y / w: texture coordinates; z / w: 0–1 along the rays of the key light
  vec4 eye;                // w: samples along a pixel's side
  vec4 ray_corner;         // ray through the picture's pixel (x, y): ray_corner + x ray_right + y ray_up
  vec4 ray_right;
  vec4 ray_up;
  vec4 key;                // of the light that casts shadows: place and 1, or unit direction towards it and 0
  vec4 to_sun;             // unit; w: 1 where it is the key light
  vec4 sun;                // radiance of a white surface that faces it
  vec4 zenith;             // radiances
  vec4 horizon;
  vec4 bounce;             // of the ground in light
  vec4 ground_color;       // w: height of the ground
  vec4 ground_reach;       // distances: fading begins, ends; z: weight of the decimetre lines; w: radius of the disc
  vec4 shadow_scale;       // x: texture coordinates per metre; y: bias, m; z: metres along the ray for z from 0 to 1;
                           // w: 1 with shadows. With a lamp as key light x and z hold 1 m in front of it
  vec4 occlusion;          // x, y: world x, z of the occlusion map's corner; z: 1 / its width; w: 1 / height it reaches
  vec4 depth_terms;        // depth d lies x / (y - d) along a ray; z: texels of the shadow map a side
};
)";

const char* const poses_glsl = R"(
layout(location = 8) in float body;
layout(std140) uniform ClipPoses { mat4 clip_from_bodies[BODIES]; };
layout(std140) uniform WorldPoses { mat4 world_from_bodies[BODIES]; };
)";

const char* const optics_glsl = R"(
// Without lamps the sun is the key light, and its rays are parallel.
#ifdef LOOKS
#define KEY key
#define SUN_IS_KEY (to_sun.w > 0.5)
#else
#define KEY vec4(to_sun.xyz, 0.0)
#define SUN_IS_KEY true
#endif
float square(float x) { return x * x; }

/// Returns the radiance of the sky along a unit direction; below the horizon, of the horizon.
vec3 sky_light(vec3 direction) {
  float up = max(direction.y, 0.0);
  float low = 1.0 - up;
  float haze = square(low * low);
  float towards = max(dot(direction, to_sun.xyz), 0.0);
  float glow = square(square(towards * towards));
  vec3 color = mix(zenith.rgb, horizon.rgb, haze);
  return color + sun.rgb * (0.07 * glow * (0.35 + 0.65 * haze));
}

/// Returns the radiance of sky and ground from a unit direction, averaged over the lobe of this roughness.
vec3 surroundings(vec3 direction, float roughness) {
  float width = 0.04 + 0.7 * roughness;
  float above = clamp(0.5 + 0.5 * direction.y / width, 0.0, 1.0);
  above = above * above * (3.0 - 2.0 * above);
  vec3 rise = normalize(vec3(direction.x, max(direction.y, 0.25 * roughness), direction.z));
  // Straight down lies the shaded foot of the reflecting body.
  float level = 1.0 + min(direction.y, 0.0);
  return mix(bounce.rgb * (0.5 + 0.5 * level), sky_light(rise), above);
}

/// Returns sRGB's code by roots alone; their fit is within 0.41 of an 8-bit code.
vec3 srgb(vec3 y) {
  vec3 r2 = sqrt(y);
  vec3 r4 = sqrt(r2);
  vec3 r8 = sqrt(r4);
  vec3 curve = 0.130942 * y - 0.092702 * r2 + 2.271373 * r4 - 1.590231 * r8 + 0.282206;
  return mix(curve, 12.92 * y, vec3(lessThan(y, vec3(0.0031308))));
}

/// Returns the filmic curve (Narkowicz 2015, fitted to the ACES reference).
vec3 film(vec3 radiance) {
  vec3 x = radiance * 0.72;
  return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

/// Returns the filmic curve as an sRGB code.
vec3 display(vec3 radiance) {
  return srgb(film(radiance));
}

/// Returns π times the BRDF for light from l to v: Lambert, and GGX with the height-correlated Smith term as Hammon
/// (2017) approximates it and Schlick's Fresnel term. `nl`, `nv`: cosines; `facing`: reflectance at normal incidence.
vec3 scattered(vec3 n, vec3 v, vec3 l, float nl, float nv, vec3 facing, vec3 diffuse, float roughness) {
  vec3 h = normalize(v + l);
  float nh = max(dot(n, h), 0.0);
  float vh = max(dot(v, h), 0.0);
  float alpha = roughness * roughness;
  float bell = nh * nh * (alpha * alpha - 1.0) + 1.0;
  float distribution = alpha * alpha / (bell * bell);
  float visibility = 0.5 / mix(2.0 * nl * nv, nl + nv, alpha);
  float away = 1.0 - vh;
  vec3 fresnel = facing + (1.0 - facing) * (square(square(away)) * away);
  return diffuse * (1.0 - fresnel) + fresnel * (distribution * visibility);
}

/// Returns the mean over a footprint of `width` around x of lines of half-width `half_line` at the integers.
vec2 lines(vec2 x, vec2 width, float half_line) {
  vec2 a = x - 0.5 * width + 0.5;
  vec2 b = x + 0.5 * width + 0.5;
  vec2 within_a = clamp(fract(a) - 0.5 + half_line, vec2(0.0), vec2(2.0 * half_line)) + floor(a) * 2.0 * half_line;
  vec2 within_b = clamp(fract(b) - 0.5 + half_line, vec2(0.0), vec2(2.0 * half_line)) + floor(b) * 2.0 * half_line;
  return (within_b - within_a) / width;
}

/// Returns the mean over a footprint of `width` around x of ±1 in turn between the integers.
vec2 turns(vec2 x, vec2 width) {
  vec2 a = (x - 0.5 * width) * 0.5;
  vec2 b = (x + 0.5 * width) * 0.5;
  vec2 sum_a = abs(fract(a) - 0.5);
  vec2 sum_b = abs(fract(b) - 0.5);
  return 2.0 * (sum_a - sum_b) / width;
}

/// Returns the ground's colour with its checker, and its lines at metres and decimetres.
vec3 patterned(vec3 color, vec2 xz, vec2 footprint, float fine_weight) {
  vec2 checker = turns(xz, footprint);
  vec2 joint = lines(xz, footprint, 0.008);
  vec2 fine = lines(xz * 10.0, footprint * 10.0, 0.016);
  float joints = joint.x + joint.y - joint.x * joint.y;
  float fines = fine.x + fine.y - fine.x * fine.y;
  vec3 result = color * (1.0 + 0.045 * checker.x * checker.y);
  result *= 1.0 - 0.30 * joints;
  return result * (1.0 - 0.16 * fines * fine_weight);
}

#ifdef LOOKS
uniform int light_count;
uniform vec4 light_positions[16];  // w: 1; or the direction towards a light infinitely far, and 0
uniform vec4 light_axes[16];       // against the direction a spot shines in; w: 1 / range²
uniform vec4 light_cones[16];      // x, y: of the cosine between the axis and the way to the light; z: 1 for the key
uniform vec4 light_colors[16];

/// Returns the radiance at `position` of a white surface that faces the light. Sets `towards`, the unit direction to the
/// light. `lit`: fraction of the key light that reaches the surface.
vec3 lamp(int i, vec3 position, float lit, out vec3 towards) {
  vec3 way = light_positions[i].xyz - light_positions[i].w * position;
  float distance2 = max(dot(way, way), 1e-8);
  towards = way * (1.0 / sqrt(distance2));
  float cone = clamp(dot(light_axes[i].xyz, towards) * light_cones[i].x + light_cones[i].y, 0.0, 1.0);
  // The light fades to nothing at the end of its range, and only in the last part of it.
  float fading = max(1.0 - square(distance2 * light_axes[i].w), 0.0);
  float strength = mix(1.0, fading / max(distance2, 1e-4), light_positions[i].w) * square(cone);
  return light_colors[i].rgb * (light_cones[i].z > 0.5 ? strength * lit : strength);
}
#endif

/// Returns the radiance of the ground. `lit`, `open`: fractions of the key light and of the sky's that reach `position`.
vec3 ground_light(vec3 color, vec3 position, float lit, float open) {
  vec3 sky = mix(zenith.rgb, horizon.rgb, 0.55);
  vec3 radiance = color * (sun.rgb * (max(to_sun.y, 0.0) * (SUN_IS_KEY ? lit : 1.0)) + sky * open);
#ifdef LOOKS
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, position, lit, towards);
    radiance += color * light * max(towards.y, 0.0);
  }
#endif
  return radiance;
}

/// Returns the ground's light as it fades into the sky from distance `begin` to `end`; `away`: from the eye.
vec3 in_haze(vec3 radiance, vec3 away, float begin, float end) {
  float fade = clamp((length(away) - begin) / (end - begin), 0.0, 1.0);
  fade = 1.0 - square(1.0 - fade);
  vec3 level = normalize(vec3(away.x, 0.0, away.z));
  return mix(radiance, sky_light(level), fade);
}

/// Returns the radiance towards v of a surface in the light of sun and lamps. `lit`: fraction of the key light.
vec3 direct_light(vec3 position, vec3 n, vec3 v, float nv, vec3 facing, vec3 diffuse, float roughness, float lit) {
  vec3 radiance = vec3(0.0);
#ifndef NO_SUN
  vec3 l = to_sun.xyz;
  float nl = max(dot(n, l), 0.0);
  radiance = scattered(n, v, l, nl, nv, facing, diffuse, roughness) * sun.rgb * (nl * (SUN_IS_KEY ? lit : 1.0));
#endif
#ifdef LOOKS
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, position, lit, towards);
    float facing_light = max(dot(n, towards), 0.0);
    radiance += scattered(n, v, towards, facing_light, nv, facing, diffuse, roughness) * light * facing_light;
  }
#endif
  return radiance;
}
)";

const char* const key_light_glsl = R"(
uniform sampler2D shadow_depth;
uniform sampler2DShadow shadow_test;
uniform sampler2D shadow_nearest;
uniform sampler2D occlusion_map;

/// Returns the direction turned by the golden angle: Vogel's spiral of such points covers the disc evenly.
vec2 turned_on(vec2 direction) {
  const float c = -0.7373688780783197;
  const float s = 0.6754902942615238;
  return vec2(c * direction.x - s * direction.y, s * direction.x + c * direction.y);
}

/// Returns the slope of z in the map along a surface with unit normal n, at most 8 m of depth a metre across.
vec2 slope_in_map(mat4 map, vec3 n, vec2 place, float w, float map_depth) {
  vec4 plane = map * vec4(n, 0.0);
  plane.xy = (plane.xy - 0.5 * plane.w) / square(shadow_scale.x);
  // Divide the change across the map by the change along the ray, for a lamp the ray through `place`
  float along_ray = KEY.w > 0.5 ? (plane.w + dot(place - 0.5, plane.xy)) * w * shadow_scale.z
                                : plane.z * square(shadow_scale.z);
  vec2 slope = -plane.xy / min(along_ray, -1e-6);
  float steepest = 8.0 / (shadow_scale.x / w * map_depth);
  return clamp(slope, vec2(-steepest), vec2(steepest));
}

/// Returns the fraction of the key light that reaches a point of a surface with unit normal n.
///
/// Percentage-closer soft shadows (Fernando 2005): the penumbra widens with the distance to the blocker. A software
/// rasteriser runs both sides of a branch, and a loop until its last pixel is done. So the search for blockers has a
/// fixed number of taps, which the compiler unrolls, and the penumbra a loop of variable length.
float key_light(vec3 position, vec3 n) {
  const float spread = 0.035;       // penumbra's half-width for each metre to the blocker
  const float widest = 0.03;        // fraction of the map's width
  const int search_taps = 12;
  float texel = 1.0 / depth_terms.z;
  mat4 map = shadow_from_world;
#ifndef LOOKS
  // The key light is the sun, whose map is affine: let the compiler drop the division by w
  map[0].w = map[1].w = map[2].w = 0.0;
  map[3].w = 1.0;
#endif
  vec4 seen = map * vec4(position + n * shadow_scale.y, 1.0);
  vec3 place = seen.xyz / seen.w;
  float per_metre = shadow_scale.x / seen.w;
  float map_depth = shadow_scale.z * square(seen.w);
  vec2 outside = abs(place.xy - 0.5);
  bool inside = max(outside.x, outside.y) < 0.5 && seen.w > 0.0 && shadow_scale.w > 0.5;
  float nearest = textureLod(shadow_nearest, place.xy, 0.0).r;
  vec2 slope = slope_in_map(map, n, place.xy, seen.w, map_depth);

  float search = min((place.z - nearest) * map_depth * spread * per_metre, widest);
  search = max(search, 1.5 * texel);
  bool has_nearer = inside && place.z > nearest;
  // Bound of the difference between a texel's depth and the surface's
  float bias = shadow_scale.y / map_depth + 1.2 * texel * length(slope);
  float blockers = 0.0;
  float depth = 0.0;
  float area = 0.5 / float(search_taps);
  vec2 direction = vec2(1.0, 0.0);
  for (int i = 0; i < search_taps; ++i) {
    vec2 offset = search * (sqrt(area) * direction);
    float z = textureLod(shadow_depth, place.xy + offset, 0.0).r;
    // z = 1: nothing was drawn there
    float behind = has_nearer && z < 1.0 && z + bias < place.z + dot(slope, offset) ? 1.0 : 0.0;
    blockers += behind;
    depth += behind * z;
    area += 1.0 / float(search_taps);
    direction = turned_on(direction);
  }
  float gap = (place.z - depth / max(blockers, 1.0)) * map_depth;
  float radius = clamp(gap * spread * per_metre, 1.2 * texel, widest);
  // Take three taps for each texel of the radius, 8 to 48; none where all taps of the search or none found a blocker
  float taps = clamp(floor(3.0 * radius * depth_terms.z), 8.0, 48.0);
  bool in_shadow = blockers > float(search_taps) - 0.5;
  int shadow_taps = blockers > 0.0 && !in_shadow ? int(taps) : 0;
  float lit = blockers > 0.0 ? 0.0 : 1.0;
  float part = 1.0 / taps;
  area = 0.5 * part;
  direction = vec2(1.0, 0.0);
  for (int i = 0; i < shadow_taps; ++i) {
    vec2 offset = radius * sqrt(area) * direction;
    float z = min(place.z + dot(slope, offset) - bias, 0.9999);
    lit += textureLod(shadow_test, vec3(place.xy + offset, z), 0.0) * part;
    area += part;
    direction = turned_on(direction);
  }
  return lit;
}

/// Returns the fraction of the sky that bodies leave open to the ground below `position`, or `cells` of the map beside it.
float openness(vec3 position, vec2 cells) {
  vec2 place = (position.xz - occlusion.xy) * occlusion.z + cells / 128.0;  // Relief::size
  return textureLod(occlusion_map, place, 0.0).r;
}
)";

const char* const packing_glsl = R"(
ivec4 packed_surface(vec3 normal, float roughness, vec3 color, float metallic) {
  vec4 low = vec4(normal.xz, color.rb);
  vec4 high = vec4(normal.y, roughness, color.g, 0.5 * metallic);
  ivec4 words = ivec4(floor(high * 32767.0 + 0.5)) << 16;
  return words | (ivec4(floor(low * 32767.0 + 0.5)) & 0xffff);
}

void unpack_surface(ivec4 words, out vec4 normal_roughness, out vec4 color_metallic) {
  vec4 low = vec4((words << 16) >> 16) * (1.0 / 32767.0);
  vec4 high = vec4(words >> 16) * (1.0 / 32767.0);
  normal_roughness = vec4(low.x, high.x, low.y, high.y);
  color_metallic = vec4(low.z, high.z, low.w, 2.0 * high.w);
}
)";

const char* const looks_glsl = R"(
uniform vec4 image_turns[5];    // of coordinates, row by row, for each role
uniform vec4 image_offsets[5];  // z: which set; w: texels in a unit of it
uniform vec4 emission;          // w: 1 where the colour is the light
uniform vec4 opacity;           // alpha, cut-off, 1 where blended, 1 where seen from behind too
uniform vec2 strengths;         // of normals, of occlusion
uniform sampler2D color_texture;
uniform sampler2D finish_texture;
uniform sampler2D normal_texture;
uniform sampler2D occlusion_texture;
uniform sampler2D emission_texture;

/// Returns the coordinates in the role's image of a surface; `sets` has both sets of its coordinates.
vec2 image_coordinates(int role, vec4 sets) {
  vec2 own = image_offsets[role].z > 0.5 ? sets.zw : sets.xy;
  return vec2(dot(image_turns[role].xy, own), dot(image_turns[role].zw, own)) + image_offsets[role].xy;
}

/// Returns the normal of a surface with unit normal n where the image of normals has this texel; `tangent` needs not
/// be unit nor quite square to n, its w is the handedness.
vec3 bumped(vec3 n, vec4 tangent, vec3 texel) {
  vec3 bump = (2.0 * texel - 1.0) * vec3(strengths.xx, 1.0);
  vec3 t = tangent.xyz - n * dot(n, tangent.xyz);
  t /= max(sqrt(dot(t, t)), 1e-6);
  vec3 b = cross(n, t) * tangent.w;
  return normalize(t * bump.x + b * bump.y + n * max(bump.z, 0.05));
}

/// Returns the fraction of ambient light for a texel of the occlusion texture.
float ambient_fraction(vec4 texel) { return 1.0 + strengths.y * (texel.r - 1.0); }
)";

}  // namespace substep::render::shaders
