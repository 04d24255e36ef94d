#include "render/shaders.h"

#include <fmt/format.h>

namespace substep::render::shaders {
namespace {

/// What stays the same for all pixels of a frame. FrameUniforms in renderer.cpp has the same layout.
const std::string frame = R"(
layout(std140) uniform Frame {
  mat4 clip_from_world;
  mat4 shadow_from_world;  // x / w, y / w: texture coordinates; z / w: 0–1 along the rays of the key light
  vec4 eye;                // w: samples a pixel's side
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
  vec4 shadow_scale;       // texture coordinates per metre; metres: bias, the map's depth; w: 1 with shadows.
                           // Where the key light is a lamp: coordinates and depth 1 m in front of it
  vec4 occlusion;          // x, y: world x, z of the occlusion map's corner; z: 1 / its width; w: 1 / height it reaches
  vec4 depth_terms;        // depth d lies x / (y - d) along a ray; z: texels of the shadow map a side
};
)";

/// Where bodies stand, by uniforms and attribute `body`, a body's number from first_body on.
const std::string places = fmt::format(R"(
layout(location = 8) in float body;
layout(std140) uniform ClipPlaces {{ mat4 clip_from_bodies[{0}]; }};
layout(std140) uniform WorldPlaces {{ mat4 world_from_bodies[{0}]; }};
)",
                                       bodies_at_once);

/// The colour by which Renderer::draw_bodies() names the body.
const std::string code = R"(
uniform int first_body;
flat out vec3 body_code;

vec3 code_of_body() {
  int code = first_body + int(body) + 1;
  return vec3(code & 255, code >> 8 & 255, code >> 16 & 255) / 255.0;
}
)";

/// What does not depend on where frames are drawn, by uniforms to_sun, sun, zenith, horizon and bounce.
const std::string optics_terms = R"(
float square(float x) { return x * x; }

/// Radiance of the sky along a unit direction; below the horizon, of the horizon.
vec3 sky_light(vec3 direction) {
  float up = max(direction.y, 0.0);
  float low = 1.0 - up;
  float haze = square(low * low);
  float towards = max(dot(direction, to_sun.xyz), 0.0);
  float glow = square(square(towards * towards));
  vec3 color = mix(zenith.rgb, horizon.rgb, haze);
  return color + sun.rgb * (0.07 * glow * (0.35 + 0.65 * haze));
}

/// What a surface of this roughness sees by reflection along a unit direction.
vec3 surroundings(vec3 direction, float roughness) {
  float width = 0.04 + 0.7 * roughness;
  float above = clamp(0.5 + 0.5 * direction.y / width, 0.0, 1.0);
  above = above * above * (3.0 - 2.0 * above);
  vec3 rise = normalize(vec3(direction.x, max(direction.y, 0.25 * roughness), direction.z));
  // Straight down lies the shaded foot of whatever reflects.
  float level = 1.0 + min(direction.y, 0.0);
  return mix(bounce.rgb * (0.5 + 0.5 * level), sky_light(rise), above);
}

/// sRGB's code by roots alone; their fit is within 0.41 of an 8-bit code.
vec3 srgb(vec3 y) {
  vec3 r2 = sqrt(y);
  vec3 r4 = sqrt(r2);
  vec3 r8 = sqrt(r4);
  vec3 curve = 0.130942 * y - 0.092702 * r2 + 2.271373 * r4 - 1.590231 * r8 + 0.282206;
  return mix(curve, 12.92 * y, vec3(lessThan(y, vec3(0.0031308))));
}

/// Filmic curve (Narkowicz 2015, fitted to the ACES reference).
vec3 film(vec3 radiance) {
  vec3 x = radiance * 0.72;
  return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

/// The same as a code.
vec3 display(vec3 radiance) {
  return srgb(film(radiance));
}

/// Radiance towards v of a surface in light from l of radiance 1 / cosine.
/// GGX with the height-correlated Smith term as Hammon (2017) approximates it, Fresnel as Schlick does.
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

/// Mean over a footprint of `width` around x of lines of half-width `half_line` at the integers.
vec2 lines(vec2 x, vec2 width, float half_line) {
  vec2 a = x - 0.5 * width + 0.5;
  vec2 b = x + 0.5 * width + 0.5;
  vec2 within_a = clamp(fract(a) - 0.5 + half_line, vec2(0.0), vec2(2.0 * half_line)) + floor(a) * 2.0 * half_line;
  vec2 within_b = clamp(fract(b) - 0.5 + half_line, vec2(0.0), vec2(2.0 * half_line)) + floor(b) * 2.0 * half_line;
  return (within_b - within_a) / width;
}

/// Mean over the same of ±1 in turn between the integers.
vec2 turns(vec2 x, vec2 width) {
  vec2 a = (x - 0.5 * width) * 0.5;
  vec2 b = (x + 0.5 * width) * 0.5;
  vec2 sum_a = abs(fract(a) - 0.5);
  vec2 sum_b = abs(fract(b) - 0.5);
  return 2.0 * (sum_a - sum_b) / width;
}
)";

const std::string light = optics_terms + R"(
// Without lamps the sun is the key light, and its rays are parallel.
#ifdef LOOKS
#define KEY key
#define SUN_IS_KEY (to_sun.w > 0.5)
#else
#define KEY vec4(to_sun.xyz, 0.0)
#define SUN_IS_KEY true
#endif
uniform sampler2D shadow_depth;
uniform sampler2DShadow shadow_test;
uniform sampler2D shadow_nearest;
uniform sampler2D occlusion_map;

/// The next of the points of Vogel's spiral, which are spread evenly over the disc: a golden angle on.
vec2 turned_on(vec2 direction) {
  const float c = -0.7373688780783197;
  const float s = 0.6754902942615238;
  return vec2(c * direction.x - s * direction.y, s * direction.x + c * direction.y);
}

/// Part of the key light that reaches a point of a surface with unit normal n.
///
/// Percentage-closer soft shadows (Fernando 2005): the farther what covers the sun, the wider the penumbra.
/// Branches cost a software rasteriser as much as their longest side, loops end when no pixel goes on: so the
/// taps of penumbrae, whose number varies, are taken in a loop, and the search's are laid out by the compiler.
float key_light(vec3 position, vec3 n) {
  const float spread = 0.035;       // penumbra's half-width a metre from what casts it
  const float widest = 0.03;        // of the map
  const int search_taps = 12;
  float texel = 1.0 / depth_terms.z;
  mat4 map = shadow_from_world;
#ifndef LOOKS
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

  // The surface's plane in the map: z changes by slope · offset.
  vec4 plane = map * vec4(n, 0.0);
  plane.xy = (plane.xy - 0.5 * plane.w) / square(shadow_scale.x);
  // A lamp's rays are not parallel.
  float along_ray = KEY.w > 0.5 ? (plane.w + dot(place.xy - 0.5, plane.xy)) * seen.w * shadow_scale.z
                                : plane.z * square(shadow_scale.z);
  vec2 slope = -plane.xy / min(along_ray, -1e-6);
  float steepest = 8.0 / (per_metre * map_depth);
  slope = clamp(slope, vec2(-steepest), vec2(steepest));

  float search = min((place.z - nearest) * map_depth * spread * per_metre, widest);
  search = max(search, 1.5 * texel);
  bool has_nearer = inside && place.z > nearest;
  // The map knows depths at its texels only, up to this far off the surface's own.
  float bias = shadow_scale.y / map_depth + 1.2 * texel * length(slope);
  float blockers = 0.0;
  float depth = 0.0;
  float area = 0.5 / float(search_taps);
  vec2 direction = vec2(1.0, 0.0);
  for (int i = 0; i < search_taps; ++i) {
    vec2 offset = search * (sqrt(area) * direction);
    float z = textureLod(shadow_depth, place.xy + offset, 0.0).r;
    // Nothing covers the light at the map's end.
    float behind = has_nearer && z < 1.0 && z + bias < place.z + dot(slope, offset) ? 1.0 : 0.0;
    blockers += behind;
    depth += behind * z;
    area += 1.0 / float(search_taps);
    direction = turned_on(direction);
  }
  float gap = (place.z - depth / max(blockers, 1.0)) * map_depth;
  float radius = clamp(gap * spread * per_metre, 1.2 * texel, widest);
  // As many as there are texels across a narrow penumbra; none where all around is in shadow.
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

/// Part of the sky that bodies leave open to the ground below `position`, or `cells` of the map beside it.
float openness(vec3 position, vec2 cells) {
  vec2 place = (position.xz - occlusion.xy) * occlusion.z + cells / 128.0;
  return textureLod(occlusion_map, place, 0.0).r;
}
)";

/// Packs what is seen at a sample into four words of two 15-bit fractions and signs each: a software
/// rasteriser takes as long to write and read a component of a texture as to compute several.
const std::string packing = R"(
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

/// The lights beside the sun.
const std::string lamp_terms = R"(
uniform int light_count;
uniform vec4 light_places[16];  // w: 1; or the direction towards a light infinitely far, and 0
uniform vec4 light_axes[16];    // against the direction a spot shines in; w: 1 / range²
uniform vec4 light_cones[16];   // x, y: of the cosine between the axis and the way to the light; z: 1 for the key
uniform vec4 light_colors[16];

/// Radiance at `position` of a white surface that faces the light, which lies along unit `towards`. `lit` is the
/// part of the key light that reaches it.
vec3 lamp(int i, vec3 position, float lit, out vec3 towards) {
  vec3 way = light_places[i].xyz - light_places[i].w * position;
  float distance2 = max(dot(way, way), 1e-8);
  towards = way * (1.0 / sqrt(distance2));
  float cone = clamp(dot(light_axes[i].xyz, towards) * light_cones[i].x + light_cones[i].y, 0.0, 1.0);
  // Where the light's range ends it has faded to nothing, and nowhere before the last part of it.
  float fading = max(1.0 - square(distance2 * light_axes[i].w), 0.0);
  float strength = mix(1.0, fading / max(distance2, 1e-4), light_places[i].w) * square(cone);
  return light_colors[i].rgb * (light_cones[i].z > 0.5 ? strength * lit : strength);
}
)";

/// What a Surface has beside its colour and finish, and what textures make of it.
const std::string look_terms = R"(
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

/// Where in the role's image the surface is, of whose coordinates `places` has both sets.
vec2 place_in_image(int role, vec4 places) {
  vec2 place = image_offsets[role].z > 0.5 ? places.zw : places.xy;
  return vec2(dot(image_turns[role].xy, place), dot(image_turns[role].zw, place)) + image_offsets[role].xy;
}

/// The normal of a surface with unit normal n where the image of normals has this texel; `tangent` needs not
/// be unit nor quite square to n, its w is the handedness.
vec3 bumped(vec3 n, vec4 tangent, vec3 texel) {
  vec3 bump = (2.0 * texel - 1.0) * vec3(strengths.xx, 1.0);
  vec3 t = tangent.xyz - n * dot(n, tangent.xyz);
  t /= max(sqrt(dot(t, t)), 1e-6);
  vec3 b = cross(n, t) * tangent.w;
  return normalize(t * bump.x + b * bump.y + n * max(bump.z, 0.05));
}

/// Of the light from all around, what reaches a surface where the image of occlusion has this texel.
float open_part(vec4 texel) { return 1.0 + strengths.y * (texel.r - 1.0); }
)";

/// What is seen at the samples of a pixel, in light, which is computed once for those of one face. Where
/// faces are of several surfaces, these are kept apart, two at most. With LOOKS, of surfaces that have more
/// than a colour, and in all lights. With SHINES, of surfaces that shine, have crevices or let light through.
const std::string shading = R"(
uniform sampler2D sample_depth;
uniform isampler2D packed_surfaces;
#ifdef SHINES
uniform sampler2D emission_alpha;
uniform sampler2D crevices;
#endif
layout(location = 0) out vec4 first;   // alpha's bits: which of the four samples it is of; which are bodies
layout(location = 1) out vec4 second;  // of the other bodies' samples
#ifdef SHINES
layout(location = 2) out vec4 opacities;  // of the two
#endif

struct Surface {
  vec3 position;
  vec4 normal;  // w: roughness
  vec4 color;   // w: metallic
#ifdef SHINES
  vec4 shine;
  float crevice;
#endif
};

Surface mixed(Surface a, Surface b, float part) {
  a.position = mix(a.position, b.position, part);
  a.normal = mix(a.normal, b.normal, part);
  a.color = mix(a.color, b.color, part);
#ifdef SHINES
  a.shine = mix(a.shine, b.shine, part);
  a.crevice = mix(a.crevice, b.crevice, part);
#endif
  return a;
}

/// How unlike b is to a, and a to b: below 1 where both are of one face, or of faces that light tells apart by
/// little; most between surfaces of other colours or one behind the other. `pixels`: in a metre there.
void compare(Surface a, Surface b, float pixels, out float to_a, out float to_b) {
  vec3 way = b.position - a.position;
  vec2 aside = abs(vec2(dot(way, a.normal.xyz), dot(way, b.normal.xyz))) * pixels * 0.67;
  float turned = 10.0 - 10.0 * dot(a.normal.xyz, b.normal.xyz);
  float colored = (dot(abs(a.color - b.color), vec4(1.0)) + abs(a.normal.w - b.normal.w)) * 6.7;
  vec2 both = max(max(min(aside, 4.0), min(turned, 2.0)), colored);
  to_a = both.x;
  to_b = both.y;
}

/// The samples of one face, as bits, by their unlikeness to one.
int alike(vec4 unlikeness) {
  ivec4 bits = ivec4(lessThan(unlikeness, vec4(1.0))) * ivec4(1, 2, 4, 8);
  return bits.x + bits.y + bits.z + bits.w;
}

/// The light from it to the eye, as the picture shows it, 0 to 1.
vec3 lighted(Surface surface) {
  vec3 base_color = surface.color.rgb;
  vec3 n = normalize(surface.normal.xyz);
  vec3 v = normalize(eye.xyz - surface.position);
  vec3 l = to_sun.xyz;
  float metallic = surface.color.w;
  float roughness = clamp(surface.normal.w, 0.06, 1.0);
  float nl = max(dot(n, l), 0.0);
  float nv = max(dot(n, v), 1e-3);
  vec3 facing = mix(vec3(0.04), base_color, metallic);
  vec3 diffuse = base_color * (1.0 - metallic);
  bool faces_key = dot(n, KEY.xyz - KEY.w * surface.position) > 0.0;
  float lit = faces_key ? key_light(surface.position, n) : 0.0;
  vec3 radiance = scattered(n, v, l, nl, nv, facing, diffuse, roughness) * sun.rgb * (nl * (SUN_IS_KEY ? lit : 1.0));
#ifdef LOOKS
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, surface.position, lit, towards);
    float facing_light = max(dot(n, towards), 0.0);
    radiance += scattered(n, v, towards, facing_light, nv, facing, diffuse, roughness) * light * facing_light;
  }
#endif

  // The surroundings: sky above, ground below; by the ground, bodies take the sky from each other too.
  float height = max(surface.position.y - ground_color.w, 0.0);
  // Of the ground in front of a wall, not below it.
  float open = openness(surface.position, 2.0 * n.xz);
  float shade = mix(open, 1.0, clamp(height * occlusion.w + max(n.y, 0.0), 0.0, 1.0));
  vec3 sky = mix(zenith.rgb, horizon.rgb, 0.55);
  float upward = 0.5 + 0.5 * n.y;
  vec3 around = mix(bounce.rgb * mix(shade, open, 0.4), sky * (0.35 + 0.65 * shade), upward);
  float grazing = 1.0 - nv;
  grazing = square(square(grazing)) * grazing;
  float smoothness = 1.0 - roughness;
  vec3 rim = facing + (max(vec3(smoothness), facing) - facing) * grazing;
  vec3 mirrored = surroundings(reflect(-v, n), roughness);
  vec3 ambient = diffuse * around * (1.0 - rim) + rim * mirrored * shade;
#ifdef SHINES
  radiance += ambient * surface.crevice + surface.shine.rgb;
#else
  radiance += ambient;
#endif
#ifdef LOOKS
  return surface.color.w > 1.5 ? clamp(base_color, 0.0, 1.0) : film(radiance);
#else
  return film(radiance);
#endif
}

void main() {
  int side = int(eye.w);
  ivec2 corner = ivec2(gl_FragCoord.xy) * side;
  // Of one sample alone, all four are that one.
  int next = side - 1;
  ivec2 places[4] = ivec2[4](corner, corner + ivec2(next, 0), corner + ivec2(0, next), corner + ivec2(next));
  float quarter = 0.25 * float(next);
  vec3 middle = ray_corner.xyz + gl_FragCoord.x * ray_right.xyz + gl_FragCoord.y * ray_up.xyz;
  vec3 across = quarter * ray_right.xyz;
  vec3 along = quarter * ray_up.xyz;
  vec3 rays[4] = vec3[4](middle - across - along, middle + across - along, middle - across + along,
                         middle + across + along);
  float pixel = length(ray_up.xyz);  // a metre from the eye
  float above = eye.y - ground_color.w;

  bool is_body[4];
  float away[4];
  int bodies = 0;
  for (int i = 0; i < 4; ++i) {
    float depth = texelFetch(sample_depth, places[i], 0).r;
    away[i] = depth_terms.x / (depth_terms.y - depth);
    // The ground hides what lies behind it, and gives way to what the scene draws at its height.
    float height = (above + away[i] * rays[i].y) * sign(above);
    is_body[i] = depth < 1.0 && height > -0.5 * pixel * away[i];
#ifdef LOOKS
    is_body[i] = is_body[i] && texelFetch(packed_surfaces, places[i], 0) != ivec4(0);
#endif
    bodies += is_body[i] ? 16 << i : 0;
  }

  Surface seen[4];
  for (int i = 0; i < 4; ++i) {
    seen[i].position = eye.xyz + (is_body[i] ? away[i] : 1.0) * rays[i];
    unpack_surface(texelFetch(packed_surfaces, places[i], 0), seen[i].normal, seen[i].color);
#ifdef SHINES
    // Where nothing was drawn these may be no numbers, which 0 times does not end.
    seen[i].shine = is_body[i] ? texelFetch(emission_alpha, places[i], 0) : vec4(0.0);
    seen[i].crevice = is_body[i] ? texelFetch(crevices, places[i], 0).r : 0.0;
#endif
  }
  float away_first = away[3];
  for (int i = 2; i >= 0; --i) away_first = is_body[i] ? away[i] : away_first;
  float pixels = 1.0 / (pixel * away_first);
  // Each pair once, without loops, which the compiler would not lay out.
  vec4 unlike[4];
  for (int i = 0; i < 4; ++i) unlike[i][i] = min(10.0 - 10.0 * dot(seen[i].normal.xyz, seen[i].normal.xyz), 2.0);
  compare(seen[0], seen[1], pixels, unlike[0].y, unlike[1].x);
  compare(seen[0], seen[2], pixels, unlike[0].z, unlike[2].x);
  compare(seen[0], seen[3], pixels, unlike[0].w, unlike[3].x);
  compare(seen[1], seen[2], pixels, unlike[1].z, unlike[2].y);
  compare(seen[1], seen[3], pixels, unlike[1].w, unlike[3].y);
  compare(seen[2], seen[3], pixels, unlike[2].w, unlike[3].z);

  // The first body's surface, and that which is most unlike it.
  vec4 to_one = unlike[3];
  for (int i = 2; i >= 0; --i) to_one = is_body[i] ? unlike[i] : to_one;
  vec4 to_other = to_one;
#ifdef SHINES
  opacities = vec4(seen[3].shine.a);
  for (int i = 2; i >= 0; --i) opacities = is_body[i] ? vec4(seen[i].shine.a) : opacities;
#endif
  float farthest = 1.0;
  for (int i = 0; i < 4; ++i) {
    bool is_other = is_body[i] && to_one[i] > farthest;
    to_other = is_other ? unlike[i] : to_other;
#ifdef SHINES
    opacities.y = is_other ? seen[i].shine.a : opacities.y;
#endif
    farthest = is_other ? to_one[i] : farthest;
  }
  int of_first = 0;
  for (int i = 0; i < 4; ++i) {
    bool is_one = is_body[i] && (farthest == 1.0 || to_one[i] < to_other[i]);
    of_first += is_one ? 1 << i : 0;
  }
  // Face by face: first of those samples that are left, and all like it. A rasteriser without branches goes once
  // more through a loop that is left at its head.
  int left = bodies / 16;
  vec4 lights[2] = vec4[2](vec4(0.0), vec4(0.0));
  do {
    int begun = left & -left;
    bool is_one = (of_first & begun) != 0;
    int like = alike(unlike[3]);
    for (int i = 2; i >= 0; --i) like = begun == 1 << i ? alike(unlike[i]) : like;
    int taken = (left & like & (is_one ? of_first : ~of_first)) | begun;
    // The mean of those taken; the first of them replaces what comes before it.
    Surface mean = seen[0];
    float count = float(taken & 1);
    for (int i = 1; i < 4; ++i) {
      bool is_taken = (taken & 1 << i) != 0;
      count += is_taken ? 1.0 : 0.0;
      mean = mixed(mean, seen[i], is_taken ? 1.0 / count : 0.0);
    }
    vec4 light = vec4(lighted(mean) * count, count);
    lights[0] += is_one ? light : vec4(0.0);
    lights[1] += is_one ? vec4(0.0) : light;
    left -= taken;
  } while (left > 0);
  vec3 codes[2];
  for (int i = 0; i < 2; ++i) codes[i] = srgb(lights[i].rgb / max(lights[i].w, 1.0));
  first = vec4(codes[0], float(bodies + of_first) / 255.0);
  second = vec4(codes[1], 1.0);
  // Ground and sky are drawn where they are seen.
  gl_FragDepth = bodies == 240 ? 0.0 : 1.0;
}
)";

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

std::string optics() {
  return optics_terms;
}

std::string lamps() {
  return lamp_terms;
}

std::string looks() {
  return look_terms;
}

std::string look_shading_fragment(bool shines) {
  return std::string("#define LOOKS\n") + (shines ? "#define SHINES\n" : "") + frame + light + lamp_terms +
         packing + shading;
}

std::string look_vertex() {
  return places + R"(
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
  return look_terms + packing + R"(
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
  return places + code + R"(
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
  return look_terms + R"(
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
  return places + R"(
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
  return packing + R"(
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

std::string shading_fragment() {
  return frame + light + packing + shading;
}

std::string ground_vertex() {
  return frame + R"(
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
  return sunlit + open + (with_lamps ? "#define LOOKS\n" : "") + frame + light +
         (with_lamps ? lamp_terms : "") + ground;
}

std::string sky_vertex() {
  return frame + R"(
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";
}

std::string sky_fragment() {
  return frame + light + R"(
out vec4 code;
void main() {
  vec3 ray = ray_corner.xyz + gl_FragCoord.x * ray_right.xyz + gl_FragCoord.y * ray_up.xyz;
  code = vec4(display(sky_light(normalize(ray))), 1.0);
}
)";
}

std::string depth_vertex() {
  return places + R"(
layout(location = 0) in vec3 position;
void main() { gl_Position = clip_from_bodies[int(body)] * vec4(position, 1.0); }
)";
}

std::string color_vertex() {
  return places + code + R"(
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
