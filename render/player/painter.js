// The pictures of the panels.

class Painter {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, data) {
    this.data = data;
    this.gl = canvas.getContext('webgl2', {antialias: true, alpha: true, powerPreference: 'high-performance'});
    if (!this.gl) throw new Error('This browser has no WebGL 2, which the pictures need; the strips are there.');
    // With blended surfaces keep and average the picture in linear light.
    this.hasVeils = data.meshes.some((primitives) => primitives.some(({look}) => look.isBlended));
    const defines = (data.looks ? '#define LOOKS_SHOWN\n' : '') + (this.hasVeils ? '#define AS_LIGHT\n' : '');
    this.programs = {
      body: this.program(PLACED, BODY, defines), ground: this.program(GROUND_PLACE, GROUND, defines),
      sky: this.program(SCREEN, SKY, defines), depth: this.program(PLACED, DEPTH, defines),
      number: this.program(PLACED, NUMBER, defines), outline: this.program(SCREEN, OUTLINE), codes: this.program(SCREEN, CODES),
    };
    this.bodies = new Bodies(this.gl, data);
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

  /** What light passes through, from back to front, and of each its far side first. */
  drawVeils(track, k, view) {
    const {gl} = this;
    const away = (veil) => dot(minus(placed(poseAt(this.data, track, k, veil.body), veil.middle), view.eye), view.forward);
    const veils = this.bodies.veils.map((veil) => [away(veil), veil]).sort(([a], [b]) => b - a);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const [, veil] of veils) {
      for (const hidden of [gl.FRONT, gl.BACK]) {
        gl.cullFace(hidden);
        this.bodies.draw(this.programs.body, view.clip, [veil]);
      }
    }
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** Returns the balls around the bodies that are near those that move and in sight. */
  ballsInSight(track, k, camera) {
    return this.data.bodies.flatMap((body, i) => {
      const radius = this.bodies.radii[i];
      const place = poseAt(this.data, track, k, i);
      const isNear = Math.hypot(...minus(place, camera.target)) < 3 * camera.home;
      return !isNear || radius === 0 || (!body.moves && radius > 6 * this.bodies.largest) ? [] : [{place: place.slice(0, 3), radius}];
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
    // The map's depth holds everything below, with the ground.
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
    this.bodies.draw(this.programs.depth, view.clip, this.bodies.draws);
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
    this.bodies.place(track, k, () => null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.numbers);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.bodies.draw(this.programs.number, view.clip, [...this.bodies.draws, ...this.bodies.veils]);
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
