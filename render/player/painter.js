// The pictures: bodies, ground and sky in WebGL 2, in the light of the films: OPTICS, from the films' own shaders.

const LIGHT = `#version 300 es
precision highp float;
uniform vec3 eye, to_sun, sun, zenith, horizon, bounce, ground_color;
uniform float ground, reach;
uniform mat4 shadow_from_world;
uniform highp sampler2DShadow shadow;
uniform float shadow_bias;

` + OPTICS + `
/// Part of the sun that reaches a point: twelve taps of a spiral.
float sunlight(vec3 position, vec3 n) {
  vec3 place = (shadow_from_world * vec4(position + n * shadow_bias, 1.0)).xyz * 0.5 + 0.5;
  vec2 outside = abs(place.xy - 0.5);
  if (max(outside.x, outside.y) > 0.5 || place.z > 1.0) return 1.0;
  float lit = 0.0;
  for (int i = 0; i < 12; ++i) {
    float radius = 0.0022 * sqrt((float(i) + 0.5) / 12.0);
    float angle = 2.39996 * float(i);
    lit += texture(shadow, vec3(place.xy + radius * vec2(cos(angle), sin(angle)), place.z));
  }
  return lit / 12.0;
}
`;

const PLACED = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) in vec4 turn;
layout(location = 4) in vec4 tint;
layout(location = 5) in float body;
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
  gl_Position = clip_from_world * vec4(world_position, 1.0);
}
`;

const BODY = LIGHT + `
in vec3 world_position;
in vec3 world_normal;
flat in vec4 tint_color;
uniform vec3 color;
uniform vec2 finish;
out vec4 code;
void main() {
  vec3 base_color = mix(color, tint_color.rgb, tint_color.a);
  float metallic = mix(finish.x, 0.0, tint_color.a);
  float roughness = clamp(finish.y, 0.06, 1.0);
  vec3 n = normalize(gl_FrontFacing ? world_normal : -world_normal);
  vec3 v = normalize(eye - world_position);
  float nl = max(dot(n, to_sun), 0.0);
  float nv = max(dot(n, v), 1e-3);
  vec3 facing = mix(vec3(0.04), base_color, metallic);
  vec3 diffuse = base_color * (1.0 - metallic);
  float lit = nl > 0.0 ? sunlight(world_position, n) : 0.0;
  vec3 radiance = scattered(n, v, to_sun, nl, nv, facing, diffuse, roughness) * sun * (nl * lit);
  vec3 around = mix(bounce, mix(zenith, horizon, 0.55), 0.5 + 0.5 * n.y);
  vec3 rim = facing + (max(vec3(1.0 - roughness), facing) - facing) * pow(1.0 - nv, 5.0);
  radiance += diffuse * around * (1.0 - rim) + rim * surroundings(reflect(-v, n), roughness);
  code = vec4(display(radiance), 1.0);
}
`;

const GROUND_PLACE = `#version 300 es
uniform mat4 clip_from_world;
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
  float lit = sunlight(world_position, vec3(0.0, 1.0, 0.0));
  vec3 radiance = color * (sun * (max(to_sun.y, 0.0) * lit) + mix(zenith, horizon, 0.55));
  float fade = clamp((length(away) - reach / 16.0) / (reach - reach / 16.0), 0.0, 1.0);
  fade = 1.0 - square(1.0 - fade);
  code = vec4(display(mix(radiance, sky_light(normalize(vec3(away.x, 0.0, away.z))), fade)), 1.0);
}
`;

const SCREEN = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 1.0, 1.0); }
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

const NUMBER = `#version 300 es
precision highp float;
flat in float body_number;
out vec4 code;
void main() { code = vec4(mod(body_number, 256.0), floor(body_number / 256.0), 0.0, 255.0) / 255.0; }
`;

const NOTHING = `#version 300 es
precision highp float;
void main() {}
`;

const OUTLINE = `#version 300 es
precision highp float;
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

class Painter {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, data) {
    this.data = data;
    this.gl = canvas.getContext('webgl2', {antialias: true, alpha: true, powerPreference: 'high-performance'});
    if (!this.gl) throw new Error('This browser has no WebGL 2, which the pictures need; the strips are there.');
    this.programs = {
      body: this.program(PLACED, BODY), ground: this.program(GROUND_PLACE, GROUND), sky: this.program(SCREEN, SKY),
      depth: this.program(PLACED, NOTHING), number: this.program(PLACED, NUMBER), outline: this.program(SCREEN, OUTLINE),
    };
    this.upload();
    this.makeShadow();
    this.numbers = this.gl.createFramebuffer();
    this.nothing = this.gl.createVertexArray();
  }

  program(vertex, fragment) {
    const {gl} = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
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
    return {program, uniforms};
  }

  /** Meshes, and one buffer of the bodies' instances, mesh by mesh: a mesh is drawn for all its bodies at once. */
  upload() {
    const {gl, data} = this;
    this.order = [];
    this.draws = [];
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
      for (const primitive of primitives) this.draws.push(this.uploadPrimitive(primitive, this.order.length, bodies.length));
      this.order.push(...bodies);
    });
    this.instanceValues = new Float32Array(this.order.length * 12);
    const moving = data.bodies.map((body, i) => body.moves ? this.radii[i] : 0);
    this.largest = Math.max(0.01, ...moving);
  }

  uploadPrimitive(primitive, first, count) {
    const {gl} = this;
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    [primitive.positions, primitive.normals].forEach((values, location) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 0, 0);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    [[2, 3, 0], [3, 4, 3], [4, 4, 7], [5, 1, 11]].forEach(([location, width, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, gl.FLOAT, false, 48, 48 * first + 4 * offset);
      gl.vertexAttribDivisor(location, 1);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, primitive.indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return {vertices, count, size: primitive.indices.length, color: primitive.color, finish: [primitive.metallic, primitive.roughness]};
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

  /** Draws all bodies by a program. */
  drawBodies({program, uniforms}, clip) {
    const {gl} = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(uniforms.clip_from_world, false, clip);
    for (const draw of this.draws) {
      if (uniforms.color) gl.uniform3fv(uniforms.color, draw.color);
      if (uniforms.finish) gl.uniform2fv(uniforms.finish, draw.finish);
      gl.bindVertexArray(draw.vertices);
      gl.drawElementsInstanced(gl.TRIANGLES, draw.size, gl.UNSIGNED_INT, 0, draw.count);
    }
    gl.bindVertexArray(null);
  }

  /** The sun's map of what is near the bodies that move and in sight. */
  drawShadow(track, k, camera) {
    const {gl, data} = this;
    const forward = unit(data.light.to_sun.map((v) => -v));
    const right = unit(crossed(forward, Math.abs(forward[1]) > 0.99 ? [0, 0, 1] : [0, 1, 0]));
    const up = crossed(right, forward);
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    data.bodies.forEach((body, i) => {
      const radius = this.radii[i];
      const place = poseAt(data, track, k, i);
      const isNear = Math.hypot(...minus(place, camera.target)) < 3 * camera.home;
      if (!isNear || radius === 0 || (!body.moves && radius > 6 * this.largest)) return;
      [right, up, forward].forEach((axis, c) => {
        low[c] = Math.min(low[c], dot(axis, place) - radius);
        high[c] = Math.max(high[c], dot(axis, place) + radius);
      });
    });
    if (!(low[0] < high[0])) low.fill(-1), high.fill(1);
    const half = Math.max(high[0] - low[0], high[1] - low[1]) / 2 * 1.02;
    let eye = [0, 0, 0];
    [right, up, forward].forEach((axis, c) => { eye = plus(eye, axis, c < 2 ? (low[c] + high[c]) / 2 : low[c] - half); });
    // What lies below, the ground too, is in the map's depth.
    const far = high[2] - low[2] + 9 * half;
    const clip = clipFrom({eye, right, up, forward, x: half, y: half, near: 0, far, perspective: false});
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow.framebuffer);
    gl.viewport(0, 0, this.shadow.size, this.shadow.size);
    gl.disable(gl.SCISSOR_TEST);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 4);
    this.drawBodies(this.programs.depth, clip);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return {clip, bias: 0.001 + 1.5 * half / this.shadow.size};
  }

  /** What the shaders are told of light, view and shadow. */
  prepare({program, uniforms}, view, shadow) {
    const {gl, data} = this;
    gl.useProgram(program);
    for (const name of ['to_sun', 'sun', 'zenith', 'horizon', 'bounce', 'ground_color']) {
      if (uniforms[name]) gl.uniform3fv(uniforms[name], data.light[name]);
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
    gl.viewport(...box);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...box);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
    this.drawSurroundings(view, shadow);
    this.prepare(this.programs.body, view, shadow);
    this.drawBodies(this.programs.body, view.clip);
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

  /** Outlines of where a track has the bodies. */
  drawGhost(track, k, view) {
    const {gl} = this;
    const {width, height} = gl.canvas;
    if (this.numbersSize !== `${width}x${height}`) this.makeNumbers(width, height);
    this.fillInstances(track, k, () => null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.numbers);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawBodies(this.programs.number, view.clip);
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
