// The bodies' meshes, textures and poses in WebGL 2.

/** Samplers by Surface::Role, and the texture unit of the first. The shadow, and passes without bodies, use unit 0. */
const TEXTURE_NAMES = ['color_texture', 'finish_texture', 'normal_texture', 'occlusion_texture', 'emission_texture'];
const TEXTURE_UNIT = 1;

/** Meshes, and one buffer of the bodies' instances, mesh by mesh: a mesh is drawn for all its bodies at once. */
class Bodies {
  constructor(gl, data) {
    this.gl = gl;
    this.data = data;
    this.textures = new Map();
    this.samplers = new Map();
    this.order = [];
    this.draws = [];
    this.blended = [];
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
    this.largest = Math.max(...moving) || Infinity;
  }

  /** Uploads a primitive, drawn for all bodies at once; a blended one for each body alone, so that the painter can sort. */
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
      this.blended.push({...draw, vertices: this.vertexArray(attributes, elements, first + i), count: 1, body, middle});
    });
  }

  /** Returns a vertex array of the instances from `first` on. */
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
    // Location, width and offset of an instance's 12 numbers: position, quaternion, tint, number of a moving body
    [[2, 3, 0], [3, 4, 3], [4, 4, 7], [5, 1, 11]].forEach(([location, width, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, width, gl.FLOAT, false, 48, 48 * first + 4 * offset);
      gl.vertexAttribDivisor(location, 1);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, elements);
    gl.bindVertexArray(null);
    // Make vertices without a colour white.
    gl.vertexAttrib4f(8, 1, 1, 1, 1);
    return vertices;
  }

  uploadLook(look) {
    if (!this.data.looks) return look;
    const bound = look.textures.map(({image, isColor, sampler}) => ({texture: this.texture(image, isColor), sampler: this.sampler(sampler)}));
    return {...look, bound};
  }

  /** Returns an image's texture, as colour or as numbers; image −1 is one white texel, which changes nothing. */
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

  /** Returns the sampler of a glTF sampler, whose numbers are those of WebGL. */
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

  /** Places the bodies as at frame k of the track; `tint` gives a body's colour, or nothing. */
  place(track, k, tint) {
    const {gl, data} = this;
    this.order.forEach((body, slot) => {
      this.instanceValues.set(poseAt(data, track, k, body), 12 * slot);
      this.instanceValues.set(tint(body) || [0, 0, 0, 0], 12 * slot + 7);
      this.instanceValues[12 * slot + 11] = data.bodies[body].moves ? body : 0;
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, this.instanceValues, gl.DYNAMIC_DRAW);
  }

  /** Draws primitives with a program and a view. */
  draw(program, clip, draws) {
    const {gl} = this;
    useProgram(gl, program, {clip_from_world: clip});
    for (const {look, vertices, size, count} of draws) {
      useProgram(gl, program, look);
      (look.bound || []).forEach(({texture, sampler}, role) => {
        gl.activeTexture(gl.TEXTURE0 + TEXTURE_UNIT + role);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.bindSampler(TEXTURE_UNIT + role, sampler);
      });
      gl.activeTexture(gl.TEXTURE0);
      gl.bindVertexArray(vertices);
      gl.drawElementsInstanced(gl.TRIANGLES, size, gl.UNSIGNED_INT, 0, count);
    }
    gl.bindVertexArray(null);
  }
}
