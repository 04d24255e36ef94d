// The pictures: bodies, ground and sky in WebGL 2, in the light of the films: OPTICS, LAMPS and LOOKS, from the films' own shaders.
// LOOKS_SHOWN is defined for scenes whose surfaces have more than a colour or that have lights beside the sun, AS_LIGHT where shaders
// give the picture's light, not its codes.

const LIGHT = `precision highp float;
uniform vec3 eye, sun, zenith, horizon, bounce, ground_color;
uniform vec4 to_sun, key;  // of the films' block Frame
uniform float ground, reach;
uniform mat4 shadow_from_world;
uniform highp sampler2DShadow shadow;
uniform float shadow_bias;

` + OPTICS + `
#ifdef AS_LIGHT
#define display film
#endif
#ifdef LOOKS_SHOWN
` + LAMPS + `
#endif

/// Part of the key light that reaches a point: twelve taps of a spiral.
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

const PLACED = `layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec4 turn;
layout(location = 4) in vec4 tint;
layout(location = 5) in float body;
#ifdef LOOKS_SHOWN
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
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }
void main() {
  world_position = turned(position) + place;
  world_normal = turned(normal);
  tint_color = tint;
  body_number = body;
#ifdef LOOKS_SHOWN
  places = vec4(coordinates, other_coordinates);
  own_color = vertex_color;
  world_tangent = vec4(turned(tangent.xyz), tangent.w);
#endif
  gl_Position = clip_from_world * vec4(world_position, 1.0);
}
`;

/** What a surface is where it is drawn, and where it is not. */
const SURFACE = `
#ifdef LOOKS_SHOWN
in vec4 places;
in vec4 own_color;
` + LOOKS + `
vec4 texel(sampler2D map, int role) { return texture(map, place_in_image(role, places)); }
#endif
uniform vec3 color;

/// Base colour and alpha, which where it is below the cut-off leaves nothing to draw.
vec4 own_base_color() {
#ifdef LOOKS_SHOWN
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
#ifdef LOOKS_SHOWN
in vec4 world_tangent;
#endif
flat in vec4 tint_color;
uniform vec2 finish;
out vec4 code;
void main() {
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 n = normalize(world_normal);
  vec2 own_finish = finish;
  float open = 1.0;
  float alpha = 1.0;
  vec3 shine = vec3(0.0);
#ifdef LOOKS_SHOWN
  // All texels before the first discard, which leaves neighbours without the places that texels are chosen by.
  own_finish *= texel(finish_texture, 1).bg;
  n = bumped(n, world_tangent, texel(normal_texture, 2).xyz);
  open = open_part(texel(occlusion_texture, 3));
  shine = emission.rgb * texel(emission_texture, 4).rgb * (1.0 - tint_color.a);
#endif
  vec4 own = own_base_color();
#ifdef LOOKS_SHOWN
  if (!gl_FrontFacing && opacity.w < 0.5) discard;
  alpha = opacity.z > 0.5 ? own.a : 1.0;
#endif
  n *= side;
  vec3 base_color = mix(own.rgb, tint_color.rgb, tint_color.a);
  float metallic = mix(own_finish.x, 0.0, tint_color.a);
  float roughness = clamp(own_finish.y, 0.06, 1.0);
  vec3 v = normalize(eye - world_position);
  float nl = max(dot(n, to_sun.xyz), 0.0);
  float nv = max(dot(n, v), 1e-3);
  vec3 facing = mix(vec3(0.04), base_color, metallic);
  vec3 diffuse = base_color * (1.0 - metallic);
  bool faces_key = dot(n, key.xyz - key.w * world_position) > 0.0;
  float lit = faces_key ? key_light(world_position, n) : 0.0;
  vec3 radiance = scattered(n, v, to_sun.xyz, nl, nv, facing, diffuse, roughness) * sun * (nl * (to_sun.w > 0.5 ? lit : 1.0));
#ifdef LOOKS_SHOWN
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, world_position, lit, towards);
    float facing_light = max(dot(n, towards), 0.0);
    radiance += scattered(n, v, towards, facing_light, nv, facing, diffuse, roughness) * light * facing_light;
  }
#endif
  vec3 around = mix(bounce, mix(zenith, horizon, 0.55), 0.5 + 0.5 * n.y);
  vec3 rim = facing + (max(vec3(1.0 - roughness), facing) - facing) * pow(1.0 - nv, 5.0);
  radiance += (diffuse * around * (1.0 - rim) + rim * surroundings(reflect(-v, n), roughness)) * open + shine;
  vec3 shown = display(radiance);
#ifdef LOOKS_SHOWN
#ifdef AS_LIGHT
  if (emission.w > 0.5) shown = clamp(base_color, 0.0, 1.0);
#else
  if (emission.w > 0.5) shown = srgb(clamp(base_color, 0.0, 1.0));
#endif
#endif
  code = vec4(shown, alpha);
}
`;

const GROUND_PLACE = `uniform mat4 clip_from_world;
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
out vec4 code;
void main() {
  vec2 xz = world_position.xz;
  vec2 width = max(fwidth(xz) * 1.2, vec2(1e-5));
  vec2 checker = turns(xz, width);
  vec2 joint = lines(xz, width, 0.008);
  vec2 fine = lines(xz * 10.0, width * 10.0, 0.016);
  vec3 color = ground_color * (1.0 + 0.045 * checker.x * checker.y);
  color *= 1.0 - 0.30 * (joint.x + joint.y - joint.x * joint.y);
  color *= 1.0 - 0.16 * (fine.x + fine.y - fine.x * fine.y) * clamp((8.0 - reach / 40.0) / 4.0, 0.0, 1.0);
  vec3 away = world_position - eye;
  float lit = key_light(world_position, vec3(0.0, 1.0, 0.0));
  vec3 radiance = color * (sun * (max(to_sun.y, 0.0) * (to_sun.w > 0.5 ? lit : 1.0)) + mix(zenith, horizon, 0.55));
#ifdef LOOKS_SHOWN
  for (int i = 0; i < light_count; ++i) {
    vec3 towards;
    vec3 light = lamp(i, world_position, lit, towards);
    radiance += color * light * max(towards.y, 0.0);
  }
#endif
  float fade = clamp((length(away) - reach / 16.0) / (reach - reach / 16.0), 0.0, 1.0);
  fade = 1.0 - square(1.0 - fade);
  code = vec4(display(mix(radiance, sky_light(normalize(vec3(away.x, 0.0, away.z))), fade)), 1.0);
}
`;

const SCREEN = `void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 1.0, 1.0); }
`;

const SKY = LIGHT + `
uniform vec3 corner, across, upward;
uniform vec4 viewport;
out vec4 code;
void main() {
  vec2 at = (gl_FragCoord.xy - viewport.xy) / viewport.zw;
  code = vec4(display(sky_light(normalize(corner + at.x * across + at.y * upward))), 1.0);
}
`;

const NUMBER = `precision highp float;
` + SURFACE + `
flat in float body_number;
out vec4 code;
void main() {
  own_base_color();
  code = vec4(mod(body_number, 256.0), floor(body_number / 256.0), 0.0, 255.0) / 255.0;
}
`;

/** Depth alone. */
const DEPTH = `precision highp float;
` + SURFACE + `
void main() { own_base_color(); }
`;

/** The picture's light as its codes. */
const CODES = `precision highp float;
uniform vec3 sun, zenith, horizon, bounce;
uniform vec4 to_sun;
` + OPTICS + `
uniform sampler2D picture;
out vec4 code;
void main() { code = vec4(srgb(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }
`;

const OUTLINE = `precision highp float;
uniform sampler2D numbers;
uniform int thick;
uniform vec4 viewport;
out vec4 code;
vec4 at(ivec2 p) { return texelFetch(numbers, clamp(p, ivec2(viewport.xy), ivec2(viewport.xy + viewport.zw) - 1), 0); }
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  vec4 here = at(p);
  bool edge = here != at(p + ivec2(thick, 0)) || here != at(p + ivec2(0, thick));
  if (!edge) discard;
  code = vec4(0.85);
}
`;

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, f = 1) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const crossed = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
/** Two axes across a unit direction. */
const across = (forward) => {
  const right = unit(crossed(forward, Math.abs(forward[1]) > 0.99 ? [0, 0, 1] : [0, 1, 0]));
  return {right, up: crossed(right, forward)};
};

/** Column by column: rows are right, up and forward, scaled and moved; w is the depth where `perspective`. */
function clipFrom({eye, right, up, forward, x, y, near, far, perspective}) {
  const rows = [right.map((v) => v / x), up.map((v) => v / y)];
  const depth = perspective ? (far + near) / (far - near) : 2 / (far - near);
  const offset = perspective ? -2 * far * near / (far - near) : -(far + near) / (far - near);
  rows.push(forward.map((v) => v * depth), perspective ? forward : [0, 0, 0]);
  const ends = rows.map((row) => -dot(row, eye));
  ends[2] += offset;
  if (!perspective) ends[3] = 1;
  return new Float32Array([0, 1, 2].flatMap((c) => rows.map((row) => row[c])).concat(ends));
}

/** By Surface::Role; the units before theirs are the shadow's, and what a pass reads that draws no bodies. */
const TEXTURE_NAMES = ['color_texture', 'finish_texture', 'normal_texture', 'occlusion_texture', 'emission_texture'];
const TEXTURE_UNIT = 1;

class Painter {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, data) {
    this.data = data;
    this.gl = canvas.getContext('webgl2', {antialias: true, alpha: true, powerPreference: 'high-performance'});
    if (!this.gl) throw new Error('This browser has no WebGL 2, which the pictures need; the strips are there.');
    // Light goes through such surfaces as light: what is drawn is kept as light then, and averaged as light.
    this.hasVeils = data.meshes.some((primitives) => primitives.some(({look}) => look.isBlended));
    const defines = (data.looks ? '#define LOOKS_SHOWN\n' : '') + (this.hasVeils ? '#define AS_LIGHT\n' : '');
    this.programs = {
      body: this.program(PLACED, BODY, defines), ground: this.program(GROUND_PLACE, GROUND, defines),
      sky: this.program(SCREEN, SKY, defines), depth: this.program(PLACED, DEPTH, defines),
      number: this.program(PLACED, NUMBER, defines), outline: this.program(SCREEN, OUTLINE), codes: this.program(SCREEN, CODES),
    };
    this.textures = new Map();
    this.samplers = new Map();
    this.upload();
    this.makeShadow();
    this.numbers = this.gl.createFramebuffer();
    this.nothing = this.gl.createVertexArray();
  }

  program(vertex, fragment, defines = '') {
    const {gl} = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\n${defines}${text}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`WebGL: ${gl.getProgramInfoLog(program)} ${logs.join(' ')}`);
    }
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
      const {name} = gl.getActiveUniform(program, i);
      uniforms[name] = gl.getUniformLocation(program, name);
    }
    gl.useProgram(program);
    TEXTURE_NAMES.forEach((name, role) => gl.uniform1i(uniforms[name] || null, TEXTURE_UNIT + role));
    return {program, uniforms};
  }

  /** Meshes, and one buffer of the bodies' instances, mesh by mesh: a mesh is drawn for all its bodies at once. */
  upload() {
    const {gl, data} = this;
    this.order = [];
    this.draws = [];
    this.veils = [];
    this.radii = new Float32Array(data.bodies.length);
    this.instances = gl.createBuffer();
    data.meshes.forEach((primitives, mesh) => {
      const bodies = data.bodies.map((_, i) => i).filter((i) => data.bodies[i].mesh === mesh);
      if (bodies.length === 0) return;
      let radius = 0;
      for (const {positions} of primitives) {
        for (let i = 0; i < positions.length; i += 3) radius = Math.max(radius, Math.hypot(positions[i], positions[i + 1], positions[i + 2]));
      }
      for (const body of bodies) this.radii[body] = radius;
      for (const primitive of primitives) this.uploadPrimitive(primitive, this.order.length, bodies);
      this.order.push(...bodies);
    });
    this.instanceValues = new Float32Array(this.order.length * 12);
    const moving = data.bodies.map((body, i) => body.moves ? this.radii[i] : 0);
    this.largest = Math.max(0.01, ...moving);
  }

  /** What has all of its bodies drawn at once, or one by one where light passes through: from back to front. */
  uploadPrimitive(primitive, first, bodies) {
    const {gl} = this;
    const {positions, normals, coordinates, colors, tangents, indices, look} = primitive;
    const buffer = (target, values) => {
      const made = gl.createBuffer();
      gl.bindBuffer(target, made);
      gl.bufferData(target, values, gl.STATIC_DRAW);
      return made;
    };
    gl.bindVertexArray(null);
    const attributes = [[0, 3, positions], [1, 3, normals], [6, 2, coordinates[0]], [7, 2, coordinates[1]], [8, 4, colors], [9, 4, tangents]]
      .filter(([, , values]) => values)
      .map(([location, width, values]) => ({location, width, buffer: buffer(gl.ARRAY_BUFFER, values)}));
    const elements = buffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    const draw = {size: indices.length, look: this.uploadLook(look)};
    if (!look.isBlended) {
      this.draws.push({...draw, vertices: this.vertexArray(attributes, elements, first), count: bodies.length});
      return;
    }
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    positions.forEach((value, i) => { low[i % 3] = Math.min(low[i % 3], value); high[i % 3] = Math.max(high[i % 3], value); });
    const middle = low.map((value, axis) => (value + high[axis]) / 2);
    bodies.forEach((body, i) => {
      this.veils.push({...draw, vertices: this.vertexArray(attributes, elements, first + i), count: 1, body, middle});
    });
  }

  /** Of instances from `first` on. */
  vertexArray(attributes, elements, first) {
    const {gl} = this;
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    for (const {location, width, buffer} of attributes) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    [[2, 3, 0], [3, 4, 3], [4, 4, 7], [5, 1, 11]].forEach(([location, width, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, gl.FLOAT, false, 48, 48 * first + 4 * offset);
      gl.vertexAttribDivisor(location, 1);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, elements);
    gl.bindVertexArray(null);
    // Vertices without a colour of their own.
    gl.vertexAttrib4f(8, 1, 1, 1, 1);
    return vertices;
  }

  uploadLook(look) {
    if (!this.data.looks) return look;
    const bound = look.textures.map(({image, isColor, sampler}) => ({texture: this.texture(image, isColor), sampler: this.sampler(sampler)}));
    return {...look, bound};
  }

  /** Each image once as colour and once as numbers; −1: one white texel, which changes nothing. */
  texture(image, isColor) {
    const {gl, textures} = this;
    const key = `${image} ${isColor}`;
    if (textures.has(key)) return textures.get(key);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const format = isColor ? gl.SRGB8_ALPHA8 : gl.RGBA8;
    if (image < 0) {
      gl.texImage2D(gl.TEXTURE_2D, 0, format, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([255, 255, 255, 255]));
    } else {
      gl.texImage2D(gl.TEXTURE_2D, 0, format, gl.RGBA, gl.UNSIGNED_BYTE, this.data.images[image]);
      gl.generateMipmap(gl.TEXTURE_2D);
    }
    textures.set(key, texture);
    return texture;
  }

  /** glTF has WebGL's numbers. */
  sampler({wrapS, wrapT, magFilter, minFilter}) {
    const {gl, samplers} = this;
    if (!wrapS) return null;
    const key = [wrapS, wrapT, magFilter, minFilter].join();
    if (samplers.has(key)) return samplers.get(key);
    const sampler = gl.createSampler();
    for (const [name, value] of [[gl.TEXTURE_WRAP_S, wrapS], [gl.TEXTURE_WRAP_T, wrapT], [gl.TEXTURE_MAG_FILTER, magFilter],
      [gl.TEXTURE_MIN_FILTER, minFilter]]) {
      gl.samplerParameteri(sampler, name, value);
    }
    samplers.set(key, sampler);
    return sampler;
  }

  makeShadow() {
    const {gl} = this;
    const size = 1024;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, size, size);
    for (const [name, value] of [[gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL],
      [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    }
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.shadow = {framebuffer, texture, size};
  }

  /** Bodies at frame k of the track; `tint` gives a body's colour, or nothing. */
  fillInstances(track, k, tint) {
    const {gl, data} = this;
    this.order.forEach((body, slot) => {
      this.instanceValues.set(poseAt(data, track, k, body), 12 * slot);
      this.instanceValues.set(tint(body) || [0, 0, 0, 0], 12 * slot + 7);
      this.instanceValues[12 * slot + 11] = data.bodies[body].moves ? body : 0;
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, this.instanceValues, gl.DYNAMIC_DRAW);
  }

  /** Draws bodies by a program. */
  drawBodies({program, uniforms}, clip, draws) {
    const {gl} = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.clip_from_world, false, clip);
    for (const draw of draws) {
      this.setLook(uniforms, draw.look);
      gl.bindVertexArray(draw.vertices);
      gl.drawElementsInstanced(gl.TRIANGLES, draw.size, gl.UNSIGNED_INT, 0, draw.count);
    }
    gl.bindVertexArray(null);
  }

  /** What the program in use is told of a surface. */
  setLook(uniforms, look) {
    const {gl} = this;
    gl.uniform3fv(uniforms.color || null, look.color);
    gl.uniform2fv(uniforms.finish || null, look.finish);
    if (!look.bound) return;
    gl.uniform4fv(uniforms['image_turns[0]'] || null, look.turns);
    gl.uniform4fv(uniforms['image_offsets[0]'] || null, look.offsets);
    gl.uniform4fv(uniforms.emission || null, look.emission);
    gl.uniform4fv(uniforms.opacity || null, look.opacity);
    gl.uniform2fv(uniforms.strengths || null, look.strengths);
    look.bound.forEach(({texture, sampler}, role) => {
      gl.activeTexture(gl.TEXTURE0 + TEXTURE_UNIT + role);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.bindSampler(TEXTURE_UNIT + role, sampler);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  /** What light passes through, from back to front, and of each its far side first. */
  drawVeils(track, k, view) {
    const {gl} = this;
    const away = (veil) => dot(minus(placed(poseAt(this.data, track, k, veil.body), veil.middle), view.eye), view.forward);
    const veils = this.veils.map((veil) => [away(veil), veil]).sort(([a], [b]) => b - a);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const [, veil] of veils) {
      for (const hidden of [gl.FRONT, gl.BACK]) {
        gl.cullFace(hidden);
        this.drawBodies(this.programs.body, view.clip, [veil]);
      }
    }
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Returns the balls around the bodies that are near those that move and in sight. */
  ballsInSight(track, k, camera) {
    return this.data.bodies.flatMap((body, i) => {
      const radius = this.radii[i];
      const place = poseAt(this.data, track, k, i);
      const isNear = Math.hypot(...minus(place, camera.target)) < 3 * camera.home;
      return !isNear || radius === 0 || (!body.moves && radius > 6 * this.largest) ? [] : [{place: place.slice(0, 3), radius}];
    });
  }

  /** Returns the sun's view of balls, and how far shadows stay off their surfaces. */
  sunView(forward, balls) {
    const {right, up} = across(forward);
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const {place, radius} of balls) {
      [right, up, forward].forEach((axis, c) => {
        low[c] = Math.min(low[c], dot(axis, place) - radius);
        high[c] = Math.max(high[c], dot(axis, place) + radius);
      });
    }
    if (!(low[0] < high[0])) low.fill(-1), high.fill(1);
    const half = Math.max(high[0] - low[0], high[1] - low[1]) / 2 * 1.02;
    let eye = [0, 0, 0];
    [right, up, forward].forEach((axis, c) => { eye = plus(eye, axis, c < 2 ? (low[c] + high[c]) / 2 : low[c] - half); });
    // What lies below, the ground too, is in the map's depth.
    const far = high[2] - low[2] + 9 * half;
    const clip = clipFrom({eye, right, up, forward, x: half, y: half, near: 0, far, perspective: false});
    return {clip, bias: 0.001 + 1.5 * half / this.shadow.size};
  }

  /** The same of a lamp, and of balls within 72° of their middle. */
  lampView(eye, balls) {
    const forward = unit(minus(balls.reduce((sum, {place}) => plus(sum, place, 1 / balls.length), [0, 0, 0]), eye));
    const {right, up} = across(forward);
    let [half, near, far] = [0.01, Infinity, 0.1];
    for (const {place, radius} of balls) {
      const way = minus(place, eye);
      const nearest = dot(forward, way) - radius;
      near = Math.min(near, nearest);
      far = Math.max(far, nearest + 2 * radius);
      if (nearest <= 0) half = 3;
      for (const axis of [right, up]) half = Math.max(half, (Math.abs(dot(axis, way)) + radius) / nearest);
    }
    half = Math.min(half, 3);
    const clip = clipFrom({eye, right, up, forward, x: half, y: half, near: Math.max(near, 0.02 * far), far: 10 * far, perspective: true});
    return {clip, bias: 0.001 + 1.5 * half * far / this.shadow.size};
  }

  /** Draws the map that the light which casts shadows has of what is near the bodies that move. */
  drawShadow(track, k, camera) {
    const {gl} = this;
    const key = this.data.light.key.slice(0, 3);
    const balls = this.ballsInSight(track, k, camera);
    const view = this.data.light.key[3] > 0 ? this.lampView(key, balls) : this.sunView(unit(key.map((v) => -v)), balls);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow.framebuffer);
    gl.viewport(0, 0, this.shadow.size, this.shadow.size);
    gl.disable(gl.SCISSOR_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 4);
    this.drawBodies(this.programs.depth, view.clip, this.draws);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return view;
  }

  /** What the shaders are told of light, view and shadow. */
  prepare({program, uniforms}, view, shadow) {
    const {gl, data} = this;
    gl.useProgram(program);
    for (const name of ['sun', 'zenith', 'horizon', 'bounce', 'ground_color']) gl.uniform3fv(uniforms[name] || null, data.light[name]);
    for (const name of ['to_sun', 'key']) gl.uniform4fv(uniforms[name] || null, data.light[name]);
    const {lamps} = data.light;
    gl.uniform1i(uniforms.light_count || null, lamps.count);
    for (const name of lamps.count > 0 ? ['places', 'axes', 'cones', 'colors'] : []) {
      gl.uniform4fv(uniforms[`light_${name}[0]`] || null, lamps[name]);
    }
    gl.uniform3fv(uniforms.eye || null, view.eye);
    gl.uniform1f(uniforms.ground || null, data.light.ground);
    gl.uniform1f(uniforms.reach || null, view.reach);
    gl.uniformMatrix4fv(uniforms.shadow_from_world || null, false, shadow.clip);
    gl.uniform1f(uniforms.shadow_bias || null, shadow.bias);
    gl.uniform1i(uniforms.shadow || null, 0);
    gl.uniformMatrix4fv(uniforms.clip_from_world || null, false, view.clip);
    gl.uniform4fv(uniforms.viewport || null, view.box);
  }

  /** One panel: `box` is [x, y, width, height] from the canvas' lower left, in its pixels. */
  draw({track, k, camera, box, tint, ghost}) {
    const {gl} = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.fillInstances(track, k, tint);
    const shadow = this.drawShadow(track, k, camera);
    const view = camera.view(box);
    if (this.hasVeils) this.bindLight();
    gl.viewport(...box);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...box);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
    this.drawSurroundings(view, shadow);
    this.prepare(this.programs.body, view, shadow);
    this.drawBodies(this.programs.body, view.clip, this.draws);
    if (this.hasVeils) {
      this.drawVeils(track, k, view);
      this.showLight(box);
    }
    if (ghost) this.drawGhost(ghost, k, view);
    gl.disable(gl.SCISSOR_TEST);
  }

  drawSurroundings(view, shadow) {
    const {gl} = this;
    const {ground, sky} = this.programs;
    gl.bindVertexArray(this.nothing);
    this.prepare(ground, view, shadow);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 8);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    this.prepare(sky, view, shadow);
    gl.uniform3fv(sky.uniforms.corner, plus(plus(view.forward, view.right, -view.x), view.up, -view.y));
    gl.uniform3fv(sky.uniforms.across, view.right.map((v) => 2 * view.x * v));
    gl.uniform3fv(sky.uniforms.upward, view.up.map((v) => 2 * view.y * v));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** For what is drawn next: kept as light, which an sRGB buffer blends and averages as such. */
  bindLight() {
    const {gl} = this;
    const {width, height} = gl.canvas;
    const size = `${width}x${height}`;
    if (!this.light || this.light.size !== size) {
      const {framebuffer, resolved, color, depth, texture} = this.light || {};
      gl.deleteFramebuffer(framebuffer || null);
      gl.deleteFramebuffer(resolved || null);
      gl.deleteRenderbuffer(color || null);
      gl.deleteRenderbuffer(depth || null);
      gl.deleteTexture(texture || null);
      this.light = this.makeLight(width, height, size);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.light.framebuffer);
  }

  makeLight(width, height, size) {
    const {gl} = this;
    const light = {size, framebuffer: gl.createFramebuffer(), resolved: gl.createFramebuffer(), color: gl.createRenderbuffer(),
      depth: gl.createRenderbuffer(), texture: gl.createTexture()};
    const samples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    gl.bindFramebuffer(gl.FRAMEBUFFER, light.framebuffer);
    for (const [buffer, format, place] of [[light.color, gl.SRGB8_ALPHA8, gl.COLOR_ATTACHMENT0],
      [light.depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    }
    gl.bindTexture(gl.TEXTURE_2D, light.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.SRGB8_ALPHA8, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, light.resolved);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, light.texture, 0);
    return light;
  }

  /** The box of what was drawn as light on the canvas. */
  showLight([x, y, width, height]) {
    const {gl, light} = this;
    const {program, uniforms} = this.programs.codes;
    const area = [x, y, x + width, y + height];
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, light.framebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, light.resolved);
    gl.blitFramebuffer(...area, ...area, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(program);
    gl.bindTexture(gl.TEXTURE_2D, light.texture);
    gl.uniform1i(uniforms.picture, 0);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
  }

  /** Outlines of where a track has the bodies. */
  drawGhost(track, k, view) {
    const {gl} = this;
    const {width, height} = gl.canvas;
    if (this.numbersSize !== `${width}x${height}`) this.makeNumbers(width, height);
    this.fillInstances(track, k, () => null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.numbers);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawBodies(this.programs.number, view.clip, [...this.draws, ...this.veils]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const {program, uniforms} = this.programs.outline;
    gl.useProgram(program);
    gl.bindTexture(gl.TEXTURE_2D, this.numbersTexture);
    gl.uniform1i(uniforms.numbers, 0);
    gl.uniform1i(uniforms.thick, Math.max(1, Math.round(view.box[3] / 300)));
    gl.uniform4fv(uniforms.viewport, view.box);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
  }

  makeNumbers(width, height) {
    const {gl} = this;
    this.numbersSize = `${width}x${height}`;
    gl.deleteTexture(this.numbersTexture || null);
    gl.deleteRenderbuffer(this.numbersDepth || null);
    this.numbersTexture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.numbersTexture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    this.numbersDepth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.numbersDepth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.numbers);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.numbersTexture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.numbersDepth);
  }
}

/** Turns about a point; all panels have the same. */
class Camera {
  constructor({eye, target, tangent, side}) {
    this.first = {eye, target};
    this.tangent = tangent;
    this.side = side;
    this.home = Math.hypot(...minus(eye, target));
    this.reset();
  }

  reset() {
    const way = minus(this.first.eye, this.first.target);
    this.target = [...this.first.target];
    this.distance = this.home;
    this.yaw = Math.atan2(way[0], way[2]);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, way[1] / this.home)));
  }

  /** right, up, forward. */
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return {forward: [-sy * cp, -sp, -cy * cp], right: [cy, 0, -sy], up: [-sy * sp, cp, -cy * sp]};
  }

  /** For a picture of this box: the film's height, or more where else too little of the width would be seen. */
  view(box) {
    const {forward, right, up} = this.axes();
    const aspect = box[2] / box[3];
    const y = Math.max(this.tangent, this.side / aspect);
    const x = y * aspect;
    const eye = plus(this.target, forward, -this.distance);
    const reach = 40 * this.distance;
    const near = Math.min(0.02 * this.distance, 0.1);
    const clip = clipFrom({eye, right, up, forward, x, y, near, far: 2.5 * reach, perspective: true});
    return {eye, forward, right, up, x, y, reach, clip, box};
  }

  orbit(dx, dy) {
    this.yaw -= 0.008 * dx;
    this.pitch = Math.max(-1.5, Math.min(1.55, this.pitch + 0.008 * dy));
  }

  /** By pixels of a picture of this height. */
  pan(dx, dy, height) {
    const {right, up} = this.axes();
    const step = 2 * this.tangent * this.distance / height;
    this.target = plus(plus(this.target, right, -dx * step), up, dy * step);
  }

  zoom(factor) {
    this.distance = Math.max(0.02 * this.home, Math.min(30 * this.home, this.distance * factor));
  }
}

/** Where the view shows a point, in pixels from the picture's top left corner; nothing behind the eye. */
function projected(view, point, width, height) {
  const p = minus(point, view.eye);
  const ahead = dot(p, view.forward);
  if (!(ahead > 1e-3)) return null;
  const at = [width * (0.5 + 0.5 * dot(p, view.right) / (ahead * view.x)), height * (0.5 - 0.5 * dot(p, view.up) / (ahead * view.y))];
  return Math.abs(at[0]) < 1e5 && Math.abs(at[1]) < 1e5 ? at : null;
}
