// The shaders of bodies, ground and sky in WebGL 2, in the light of the films: the strings OPTICS and LOOKS are the films' own, from C++.
// The macro LOOKS is defined for scenes whose surfaces have more than a colour or that have lights besides the sun, the macro AS_LIGHT
// where shaders put out linear light, not sRGB.

const LIGHT = `precision highp float;
uniform vec3 eye, sun, zenith, horizon, bounce, ground_color;
uniform vec4 to_sun, key;  // of the films' block Frame
uniform float ground, reach;
uniform mat4 shadow_from_world;
uniform highp sampler2DShadow shadow;
uniform float shadow_bias;

` + OPTICS + `
#ifdef AS_LIGHT
// film() is display() without the encoding as sRGB.
#define display film
#endif

/// Returns the fraction of the key light that reaches a point, by twelve taps of a spiral.
float key_light(vec3 position, vec3 n) {
  vec4 seen = shadow_from_world * vec4(position + n * shadow_bias, 1.0);
  vec3 place = seen.xyz / seen.w * 0.5 + 0.5;
  vec2 outside = abs(place.xy - 0.5);
  if (seen.w <= 0.0 || max(outside.x, outside.y) > 0.5 || place.z > 1.0) return 1.0;
  float lit = 0.0;
  for (int i = 0; i < 12; ++i) {
    float radius = 0.0022 * sqrt((float(i) + 0.5) / 12.0);
    float angle = 2.39996 * float(i);
    lit += texture(shadow, vec3(place.xy + radius * vec2(cos(angle), sin(angle)), place.z));
  }
  return lit / 12.0;
}
`;

const BODY_VERTEX = `layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec4 rotation;
layout(location = 4) in vec4 tint;
layout(location = 5) in float body;
#ifdef LOOKS
layout(location = 6) in vec2 coordinates;
layout(location = 7) in vec2 other_coordinates;
layout(location = 8) in vec4 vertex_color;
layout(location = 9) in vec4 tangent;
out vec4 places;
out vec4 own_color;
out vec4 world_tangent;
#endif
uniform mat4 clip_from_world;
out vec3 world_position;
out vec3 world_normal;
flat out vec4 tint_color;
flat out float body_number;
vec3 turned(vec3 v) { return v + 2.0 * cross(rotation.xyz, cross(rotation.xyz, v) + rotation.w * v); }
void main() {
  world_position = turned(position) + place;
  world_normal = turned(normal);
  tint_color = tint;
  body_number = body;
#ifdef LOOKS
  places = vec4(coordinates, other_coordinates);
  own_color = vertex_color;
  world_tangent = vec4(turned(tangent.xyz), tangent.w);
#endif
  gl_Position = clip_from_world * vec4(world_position, 1.0);
}
`;

/** A surface's colour and cut-outs. */
const SURFACE = `
#ifdef LOOKS
in vec4 places;
in vec4 own_color;
` + LOOKS + `
vec4 texel(sampler2D map, int role) { return texture(map, image_coordinates(role, places)); }
#endif
uniform vec3 color;

/// Returns base colour and alpha; discards the fragment where alpha is below the cut-off.
vec4 own_base_color() {
#ifdef LOOKS
  vec4 base = vec4(color, opacity.x) * own_color * texel(color_texture, 0);
  if (base.a < opacity.y) discard;
  return base;
#else
  return vec4(color, 1.0);
#endif
}
`;

const BODY = LIGHT + SURFACE + `
in vec3 world_position;
in vec3 world_normal;
#ifdef LOOKS
in vec4 world_tangent;
#endif
flat in vec4 tint_color;
uniform vec2 metallic_roughness;
out vec4 fragment_color;
void main() {
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(world_normal);
  vec2 own_metallic_roughness = metallic_roughness;
  float ambient_visibility = 1.0;
  float alpha = 1.0;
  vec3 emitted = vec3(0.0);
#ifdef LOOKS
  // Read all texels before the first discard, which would leave neighbours without derivatives.
  own_metallic_roughness *= texel(finish_texture, 1).bg;
  n = bumped(n, world_tangent, texel(normal_texture, 2).xyz);
  ambient_visibility = ambient_fraction(texel(occlusion_texture, 3));
  emitted = emission.rgb * texel(emission_texture, 4).rgb * (1.0 - tint_color.a);
#endif
  vec4 own = own_base_color();
#ifdef LOOKS
  if (!gl_FrontFacing && opacity.w < 0.5) discard;
  alpha = opacity.z > 0.5 ? own.a : 1.0;
#endif
  n *= side;
  vec3 base_color = mix(own.rgb, tint_color.rgb, tint_color.a);
  float metallic = mix(own_metallic_roughness.x, 0.0, tint_color.a);
  float roughness = clamp(own_metallic_roughness.y, 0.06, 1.0);
  vec3 v = normalize(eye - world_position);
  float nv = max(dot(n, v), 1e-3);
  vec3 f0 = mix(vec3(0.04), base_color, metallic);
  vec3 diffuse = base_color * (1.0 - metallic);
  bool faces_key = dot(n, key.xyz - key.w * world_position) > 0.0;
  float lit = faces_key ? key_light(world_position, n) : 0.0;
  vec3 radiance = direct_light(world_position, n, v, nv, f0, diffuse, roughness, lit);
  vec3 around = mix(bounce, mix(zenith, horizon, 0.55), 0.5 + 0.5 * n.y);
  vec3 fresnel = f0 + (max(vec3(1.0 - roughness), f0) - f0) * pow(1.0 - nv, 5.0);
  radiance += (diffuse * around * (1.0 - fresnel) + fresnel * surroundings(reflect(-v, n), roughness)) * ambient_visibility + emitted;
  vec3 shown = display(radiance);
#ifdef LOOKS
#ifdef AS_LIGHT
  if (emission.w > 0.5) shown = clamp(base_color, 0.0, 1.0);
#else
  if (emission.w > 0.5) shown = srgb(clamp(base_color, 0.0, 1.0));
#endif
#endif
  fragment_color = vec4(shown, alpha);
}
`;

const GROUND_VERTEX = `uniform mat4 clip_from_world;
uniform vec3 eye;
uniform float ground, reach;
out vec3 world_position;
void main() {
  vec2 corner = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
  world_position = vec3(eye.x + reach * corner.x, ground, eye.z + reach * corner.y);
  gl_Position = clip_from_world * vec4(world_position, 1.0);
}
`;

const GROUND = LIGHT + `
in vec3 world_position;
out vec4 fragment_color;
void main() {
  vec2 width = max(fwidth(world_position.xz) * 1.2, vec2(1e-5));
  float fine_weight = clamp((8.0 - reach / 40.0) / 4.0, 0.0, 1.0);
  vec3 color = patterned(ground_color, world_position.xz, width, fine_weight);
  float lit = key_light(world_position, vec3(0.0, 1.0, 0.0));
  vec3 radiance = ground_light(color, world_position, lit, 1.0);
  fragment_color = vec4(display(in_haze(radiance, world_position - eye, reach / 16.0, reach)), 1.0);
}
`;

const SCREEN_VERTEX = `void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 1.0, 1.0); }
`;

const SKY = LIGHT + `
uniform vec3 corner, across, upward;
uniform vec4 viewport;
out vec4 fragment_color;
void main() {
  vec2 at = (gl_FragCoord.xy - viewport.xy) / viewport.zw;
  fragment_color = vec4(display(sky_light(normalize(corner + at.x * across + at.y * upward))), 1.0);
}
`;

/** Draws the bodies' numbers, for outlines. */
const BODY_NUMBERS = `precision highp float;
` + SURFACE + `
flat in float body_number;
out vec4 fragment_color;
void main() {
  own_base_color();
  fragment_color = vec4(mod(body_number, 256.0), floor(body_number / 256.0), 0.0, 255.0) / 255.0;
}
`;

/** Draws depth alone. */
const DEPTH = `precision highp float;
` + SURFACE + `
void main() { own_base_color(); }
`;

/** Encodes a picture of linear light as sRGB. */
const ENCODE_SRGB = `precision highp float;
uniform vec3 sun, zenith, horizon, bounce;
uniform vec4 to_sun;
` + OPTICS + `
uniform sampler2D picture;
out vec4 fragment_color;
void main() { fragment_color = vec4(srgb(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }
`;

const OUTLINE = `precision highp float;
uniform sampler2D numbers;
uniform int thick;
uniform vec4 viewport;
out vec4 fragment_color;
vec4 at(ivec2 p) { return texelFetch(numbers, clamp(p, ivec2(viewport.xy), ivec2(viewport.xy + viewport.zw) - 1), 0); }
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  vec4 here = at(p);
  bool edge = here != at(p + ivec2(thick, 0)) || here != at(p + ivec2(0, thick));
  if (!edge) discard;
  fragment_color = vec4(0.85);
}
`;
