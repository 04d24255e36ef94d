// The pictures of the panels.

/** Uses a program and sets those of its uniforms that `values` has. */
function useProgram(gl, {program, uniforms}, values) {
  gl.useProgram(program);
  for (const [name, value] of Object.entries(values)) {
    if (uniforms[name]) uniforms[name](value);
  }
}

class Painter {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, data) {
    this.data = data;
    this.gl = canvas.getContext('webgl2', {antialias: true, alpha: true, powerPreference: 'high-performance'});
    if (!this.gl) throw new Error('This browser has no WebGL 2, which the pictures need; the strips are there.');
    // Blended surfaces are drawn into an sRGB buffer, which blends in linear light.
    this.hasVeils = data.meshes.some((primitives) => primitives.some(({look}) => look.isBlended));
    const defines = (data.looks ? '#define LOOKS\n' : '') + (this.hasVeils ? '#define AS_LIGHT\n' : '');
    this.programs = {
      body: this.program(BODY_VERTEX, BODY, defines), ground: this.program(GROUND_VERTEX, GROUND, defines),
      sky: this.program(SCREEN_VERTEX, SKY, defines), depth: this.program(BODY_VERTEX, DEPTH, defines),
      number: this.program(BODY_VERTEX, BODY_NUMBERS, defines), outline: this.program(SCREEN_VERTEX, OUTLINE), codes: this.program(SCREEN_VERTEX, ENCODE_SRGB),
    };
    this.bodies = new Bodies(this.gl, data);
    this.makeShadow();
    this.targets = {};
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
    const setters = {[gl.FLOAT]: 'uniform1f', [gl.FLOAT_VEC2]: 'uniform2fv', [gl.FLOAT_VEC3]: 'uniform3fv', [gl.FLOAT_VEC4]: 'uniform4fv'};
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
      const {name, type} = gl.getActiveUniform(program, i);
      const location = gl.getUniformLocation(program, name);
      uniforms[name.replace('[0]', '')] = type === gl.FLOAT_MAT4 ? (value) => gl.uniformMatrix4fv(location, false, value)
        : (value) => gl[setters[type] || 'uniform1i'](location, value);
    }
    useProgram(gl, {program, uniforms}, Object.fromEntries(TEXTURE_NAMES.map((name, role) => [name, TEXTURE_UNIT + role])));
    return {program, uniforms};
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

  /** Draws blended surfaces from back to front, and of each its far side first. */
  drawBlended(track, k, view) {
    const {gl} = this;
    const away = (draw) => dot(minus(placed(poseAt(this.data, track, k, draw.body), draw.middle), view.eye), view.forward);
    const blended = this.bodies.blended.map((draw) => [away(draw), draw]).sort(([a], [b]) => b - a);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const [, draw] of blended) {
      for (const hidden of [gl.FRONT, gl.BACK]) {
        gl.cullFace(hidden);
        this.bodies.draw(this.programs.body, view.clip, [draw]);
      }
    }
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Returns the bounding balls of bodies near the camera's target, without large bodies at rest. */
  ballsInSight(track, k, camera) {
    return this.data.bodies.flatMap((body, i) => {
      const radius = this.bodies.radii[i];
      const place = poseAt(this.data, track, k, i);
      const isNear = Math.hypot(...minus(place, camera.target)) < 3 * camera.home;
      return !isNear || radius === 0 || (!body.moves && radius > 6 * this.bodies.largest) ? [] : [{place: place.slice(0, 3), radius}];
    });
  }

  /** Returns the bias, m, of a shadow map that is `half` wide on each side of its middle. */
  biasOf(half) {
    return Math.min(0.001, 0.004 * half) + 1.5 * half / this.shadow.size;
  }

  /** Returns the sun's view of balls, and the shadow's bias. */
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
    // The map's depth holds everything below, with the ground.
    const far = high[2] - low[2] + 9 * half;
    const clip = clipFrom({eye, right, up, forward, x: half, y: half, near: 0, far, perspective: false});
    return {clip, bias: this.biasOf(half)};
  }

  /** Returns a lamp's view of balls within 72° of their middle, and the shadow's bias. */
  lampView(eye, balls) {
    const forward = unit(minus(balls.reduce((sum, {place}) => plus(sum, place, 1 / balls.length), [0, 0, 0]), eye));
    const {right, up} = across(forward);
    let [half, near, far] = [0.01, Infinity, 0.1];
    for (const {place, radius} of balls) {
      const offset = minus(place, eye);
      const nearest = dot(forward, offset) - radius;
      near = Math.min(near, nearest);
      far = Math.max(far, nearest + 2 * radius);
      if (nearest <= 0) half = 3;
      for (const axis of [right, up]) half = Math.max(half, (Math.abs(dot(axis, offset)) + radius) / nearest);
    }
    half = Math.min(half, 3);
    const clip = clipFrom({eye, right, up, forward, x: half, y: half, near: Math.max(near, 0.02 * far), far: 10 * far, perspective: true});
    return {clip, bias: this.biasOf(half * far)};
  }

  /** Draws the shadow map around the camera's target, and returns its view. */
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
    this.bodies.draw(this.programs.depth, view.clip, this.bodies.draws);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return view;
  }

  /** Uses a program in the light, view and shadow of a picture. */
  prepare(program, view, shadow) {
    const {light, light: {lamps}} = this.data;
    const {places, axes, cones, colors} = lamps;
    const own = {light_positions: places, light_axes: axes, light_cones: cones, light_colors: colors};
    useProgram(this.gl, program, {
      ...light, ...(lamps.count > 0 ? own : {}), light_count: lamps.count, eye: view.eye, reach: view.reach, viewport: view.box,
      clip_from_world: view.clip, shadow: 0, shadow_from_world: shadow.clip, shadow_bias: shadow.bias,
    });
  }

  /** Draws one panel: `box` is [x, y, width, height] from the canvas' lower left, in its pixels. */
  draw({track, k, camera, box, tint, ghost}) {
    const {gl} = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.bodies.place(track, k, tint);
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
    this.bodies.draw(this.programs.body, view.clip, this.bodies.draws);
    if (this.hasVeils) {
      this.drawBlended(track, k, view);
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
    useProgram(gl, sky, {
      corner: plus(plus(view.forward, view.right, -view.x), view.up, -view.y),
      across: view.right.map((v) => 2 * view.x * v), upward: view.up.map((v) => 2 * view.y * v),
    });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Returns a framebuffer of the canvas' size, made anew when the size changes: multisampled with `samples`, else a texture. */
  target(name, {format, samples = 0, hasDepth}) {
    const {gl, targets} = this;
    const {width, height} = gl.canvas;
    const old = targets[name];
    if (old && old.width === width && old.height === height) return old;
    if (old) {
      gl.deleteFramebuffer(old.framebuffer);
      gl.deleteTexture(old.texture);
      for (const buffer of old.buffers) gl.deleteRenderbuffer(buffer);
    }
    const target = {width, height, framebuffer: gl.createFramebuffer(), texture: null, buffers: []};
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    const attach = (place, kind) => {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, kind, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      target.buffers.push(buffer);
    };
    if (samples > 0) {
      attach(gl.COLOR_ATTACHMENT0, format);
    } else {
      target.texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, target.texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
    }
    if (hasDepth) attach(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24);
    targets[name] = target;
    return target;
  }

  /** Directs drawing into an sRGB buffer, which blends and averages in linear light. */
  bindLight() {
    const {gl} = this;
    const samples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    const {framebuffer} = this.target('light', {format: gl.SRGB8_ALPHA8, samples, hasDepth: true});
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  }

  /** Draws over the canvas with a program that reads a texture. */
  drawScreen(program, texture, values) {
    const {gl} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    useProgram(gl, program, values);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
  }

  /** Copies a box of the light buffer to the canvas. */
  showLight([x, y, width, height]) {
    const {gl} = this;
    const area = [x, y, x + width, y + height];
    const resolved = this.target('resolved', {format: gl.SRGB8_ALPHA8, hasDepth: false});
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.targets.light.framebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, resolved.framebuffer);
    gl.blitFramebuffer(...area, ...area, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    this.drawScreen(this.programs.codes, resolved.texture, {picture: 0});
  }

  /** Draws outlines of the bodies of a track. */
  drawGhost(track, k, view) {
    const {gl} = this;
    const numbers = this.target('numbers', {format: gl.RGBA8, hasDepth: true});
    this.bodies.place(track, k, () => null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, numbers.framebuffer);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.bodies.draw(this.programs.number, view.clip, [...this.bodies.draws, ...this.bodies.blended]);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const thick = Math.max(1, Math.round(view.box[3] / 300));
    this.drawScreen(this.programs.outline, numbers.texture, {numbers: 0, thick, viewport: view.box});
    gl.disable(gl.BLEND);
  }
}
