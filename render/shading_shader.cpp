#include "render/shaders.h"

namespace substep::render::shaders {

/// Computes the light of a pixel's samples, once for all samples of one face. Up to two surfaces are kept
/// separate. With LOOKS, surfaces have more than a colour, and lamps shine; with SHINES, surfaces emit light,
/// have crevices or transmit light; with NO_SUN, only lamps and sky shine.
const char* const shading_glsl = R"(
uniform sampler2D sample_depth;
uniform isampler2D packed_surfaces;
#ifdef SHINES
uniform sampler2D emission_alpha;
uniform sampler2D crevices;
#endif
layout(location = 0) out vec4 first;   // alpha: bits 0-3: samples that it is of; bits 4-7: samples that are bodies
layout(location = 1) out vec4 second;  // colour of the other bodies' samples
#ifdef SHINES
layout(location = 2) out vec4 opacities;  // x: of first, y: of second
#endif

struct Surface {
  vec3 position;
  vec4 normal;  // w: roughness
  vec4 color;   // w: metallic; above 1.5: unlit
#ifdef SHINES
  vec4 shine;     // emitted light; a: alpha
  float crevice;  // fraction of ambient light that reaches it
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

/// Measures how unlike b is to a, and a to b: below 1 on one face or on faces lit nearly alike; largest between
/// different colours, or where one lies behind the other. `pixels`: pixels in a metre at the samples.
void compare(Surface a, Surface b, float pixels, out float to_a, out float to_b) {
  vec3 offset = b.position - a.position;
  vec2 aside = abs(vec2(dot(offset, a.normal.xyz), dot(offset, b.normal.xyz))) * pixels * 0.67;
  float turned = 10.0 - 10.0 * dot(a.normal.xyz, b.normal.xyz);
  float colored = (dot(abs(a.color - b.color), vec4(1.0)) + abs(a.normal.w - b.normal.w)) * 6.7;
  vec2 both = max(max(min(aside, 4.0), min(turned, 2.0)), colored);
  to_a = both.x;
  to_b = both.y;
}

/// Returns the samples of one face, as bits, by their unlikeness to one sample.
int alike(vec4 unlikeness) {
  ivec4 bits = ivec4(lessThan(unlikeness, vec4(1.0))) * ivec4(1, 2, 4, 8);
  return bits.x + bits.y + bits.z + bits.w;
}

/// Returns the light from a surface to the eye, as the picture shows it, 0 to 1.
vec3 lighted(Surface surface) {
  vec3 base_color = surface.color.rgb;
  vec3 n = normalize(surface.normal.xyz);
  vec3 v = normalize(eye.xyz - surface.position);
  float metallic = surface.color.w;
  float roughness = clamp(surface.normal.w, 0.06, 1.0);
  float nv = max(dot(n, v), 1e-3);
  vec3 facing = mix(vec3(0.04), base_color, metallic);
  vec3 diffuse = base_color * (1.0 - metallic);
  bool faces_key = dot(n, KEY.xyz - KEY.w * surface.position) > 0.0;
  float lit = faces_key ? key_light(surface.position, n) : 0.0;
  vec3 radiance = direct_light(surface.position, n, v, nv, facing, diffuse, roughness, lit);

  // The surroundings: sky above, ground below; near the ground bodies also hide the sky from each other.
  float height = max(surface.position.y - ground_color.w, 0.0);
  // Take the openness of the ground in front of a wall, not below it.
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

// The four samples of the pixel.
Surface seen[4];
bool is_body[4];
float away[4];   // along the ray
vec4 unlike[4];  // unlikeness of each to the others

/// Reads the samples. Returns the distance between pixels at the first sample of a body, m.
float see_samples() {
  int side = int(eye.w);
  ivec2 corner = ivec2(gl_FragCoord.xy) * side;
  // Repeat a sample that is alone.
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
  for (int i = 0; i < 4; ++i) {
    float depth = texelFetch(sample_depth, places[i], 0).r;
    away[i] = depth_terms.x / (depth_terms.y - depth);
    // The ground hides what lies behind it, but not what the scene draws at its height.
    float height = (above + away[i] * rays[i].y) * sign(above);
    is_body[i] = depth < 1.0 && height > -0.5 * pixel * away[i];
#ifdef LOOKS
    is_body[i] = is_body[i] && texelFetch(packed_surfaces, places[i], 0) != ivec4(0);
#endif
    seen[i].position = eye.xyz + (is_body[i] ? away[i] : 1.0) * rays[i];
    unpack_surface(texelFetch(packed_surfaces, places[i], 0), seen[i].normal, seen[i].color);
#ifdef SHINES
    // Where nothing was drawn the sample may be NaN, and 0 * NaN is NaN.
    seen[i].shine = is_body[i] ? texelFetch(emission_alpha, places[i], 0) : vec4(0.0);
    seen[i].crevice = is_body[i] ? texelFetch(crevices, places[i], 0).r : 0.0;
#endif
  }
  float away_first = away[3];
  for (int i = 2; i >= 0; --i) away_first = is_body[i] ? away[i] : away_first;
  return pixel * away_first;
}

/// Compares each pair of samples. A sample whose normal is much shorter than 1 is unlike itself. Pairs are written
/// out, since the compiler would not unroll loops.
void compare_samples(float pixels) {
  for (int i = 0; i < 4; ++i) unlike[i][i] = min(10.0 - 10.0 * dot(seen[i].normal.xyz, seen[i].normal.xyz), 2.0);
  compare(seen[0], seen[1], pixels, unlike[0].y, unlike[1].x);
  compare(seen[0], seen[2], pixels, unlike[0].z, unlike[2].x);
  compare(seen[0], seen[3], pixels, unlike[0].w, unlike[3].x);
  compare(seen[1], seen[2], pixels, unlike[1].z, unlike[2].y);
  compare(seen[1], seen[3], pixels, unlike[1].w, unlike[3].y);
  compare(seen[2], seen[3], pixels, unlike[2].w, unlike[3].z);
}

/// Returns which samples, as bits, are of the first body's surface, not of the one most unlike it. Sets `opacities`.
int samples_of_first() {
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
  return of_first;
}

void main() {
  float pixel = see_samples();
  compare_samples(1.0 / pixel);
  int bodies = 0;
  for (int i = 0; i < 4; ++i) bodies += is_body[i] ? 16 << i : 0;
  int of_first = samples_of_first();
  // Light face by face: the first remaining sample, and all like it. Test at the loop's end: a rasteriser without
  // branches runs a loop that tests at its head once too often.
  int left = bodies / 16;
  vec4 lights[2] = vec4[2](vec4(0.0), vec4(0.0));
  do {
    int begun = left & -left;
    bool is_one = (of_first & begun) != 0;
    int like = alike(unlike[3]);
    for (int i = 2; i >= 0; --i) like = begun == 1 << i ? alike(unlike[i]) : like;
    int taken = (left & like & (is_one ? of_first : ~of_first)) | begun;
    // Take the mean of the face's samples; the first one replaces seen[0].
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
  // Hide ground and sky behind pixels whose four samples are all bodies'.
  gl_FragDepth = bodies == 240 ? 0.0 : 1.0;
}
)";

}  // namespace substep::render::shaders
