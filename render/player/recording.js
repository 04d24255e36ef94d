// Decodes the page's data: the runs' poses, and the bodies' meshes as binary glTF.

/** Returns the bytes of the page's element `bytes`. */
async function embeddedBytes() {
  const text = document.getElementById('bytes').textContent;
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * Decodes pose_stream(): returns seven numbers for each body and frame, body 0 at rest, and the index of the next byte. `unit`:
 * quantum of positions, m; `turnParts`: quanta per unit of a quaternion component.
 */
function posesFrom(bytes, start, frames, bodies, unit, turnParts) {
  const values = new Float64Array(frames * bodies * 7);
  for (let k = 0; k < frames; ++k) values[k * bodies * 7 + 6] = 1;
  let at = start;
  for (let body = 1; frames > 0 && body < bodies; ++body) {
    for (let i = 0; i < 7; ++i) {
      const part = i < 3 ? unit : 1 / turnParts;
      let whole = 0;
      for (let k = 0; k < frames; ++k) {
        // Multiply: shifts end at 32 bits.
        let zigzag = 0;
        let weight = 1;
        for (;; weight *= 128) {
          const byte = bytes[at++];
          zigzag += (byte & 127) * weight;
          if (byte < 128) break;
        }
        whole += zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
        values[(k * bodies + body) * 7 + i] = whole * part;
      }
    }
  }
  return {values, end: at};
}

/** Returns a material's textures in the order of Surface::Role, with a white one for each that it lacks. */
function texturesOf(gltf, material) {
  const {baseColorTexture, metallicRoughnessTexture} = material.pbrMetallicRoughness;
  const infos = [baseColorTexture, metallicRoughnessTexture, material.normalTexture, material.occlusionTexture, material.emissiveTexture];
  return infos.map((info, role) => {
    const isColor = role === 0 || role === 4;
    if (!info) return {image: -1, isColor, sampler: {}, uv_matrix: [1, 0, 0, 1], offset: [0, 0], coordinates: 0};
    const {source, sampler} = gltf.textures[info.index];
    const {offset = [0, 0], rotation = 0, scale = [1, 1]} = (info.extensions || {}).KHR_texture_transform || {};
    const [c, s] = [Math.cos(rotation), Math.sin(rotation)];
    const uv_matrix = [c * scale[0], s * scale[1], -s * scale[0], c * scale[1]];
    return {image: source, isColor, sampler: gltf.samplers[sampler], uv_matrix, offset, coordinates: info.texCoord};
  });
}

/** Returns a material's uniforms, which LOOKS declares, its textures and whether it is blended. */
function lookOf(gltf, material) {
  const {baseColorFactor, metallicFactor, roughnessFactor} = material.pbrMetallicRoughness;
  const {KHR_materials_unlit: unlit, KHR_materials_emissive_strength: strong} = material.extensions || {};
  const {normalTexture, occlusionTexture, emissiveFactor = [0, 0, 0], alphaMode, alphaCutoff} = material;
  const textures = texturesOf(gltf, material);
  const emitted = emissiveFactor.map((level) => level * (strong ? strong.emissiveStrength : 1));
  const strengths = [normalTexture ? normalTexture.scale : 0, occlusionTexture ? occlusionTexture.strength : 1];
  return {
    color: baseColorFactor.slice(0, 3), metallic_roughness: [metallicFactor, roughnessFactor], textures, isBlended: alphaMode === 'BLEND',
    image_turns: textures.flatMap(({uv_matrix}) => uv_matrix), image_offsets: textures.flatMap(({offset, coordinates}) => [...offset, coordinates, 1]),
    emission: [...emitted, unlit ? 1 : 0], strengths,
    opacity: [baseColorFactor[3], alphaMode === 'MASK' ? alphaCutoff : 0, alphaMode === 'BLEND' ? 1 : 0, material.doubleSided ? 1 : 0],
  };
}

/**
 * Reads binary glTF of animated_glb(): meshes, each a list of triangles [{positions, normals, coordinates, colors, tangents, indices,
 * look}], with null for missing ones; nodes; and images, decoded without premultiplied alpha and without colour conversion.
 */
async function modelsFrom(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const jsonSize = view.getUint32(12, true);
  const gltf = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + jsonSize)));
  const binary = 28 + jsonSize;
  const kinds = {5125: Uint32Array, 5126: Float32Array};
  const widths = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4};
  const read = (index) => {
    if (index === undefined) return null;
    const accessor = gltf.accessors[index];
    const part = gltf.bufferViews[accessor.bufferView];
    const Kind = kinds[accessor.componentType];
    const begin = binary + part.byteOffset;
    const size = accessor.count * widths[accessor.type] * Kind.BYTES_PER_ELEMENT;
    return new Kind(bytes.slice(begin, begin + size).buffer);
  };
  const meshes = gltf.meshes.map((mesh) => mesh.primitives.map(({attributes, indices, material}) => {
    return {
      positions: read(attributes.POSITION), normals: read(attributes.NORMAL), coordinates: [read(attributes.TEXCOORD_0), read(attributes.TEXCOORD_1)],
      colors: read(attributes.COLOR_0), tangents: read(attributes.TANGENT),
      indices: read(indices), look: lookOf(gltf, gltf.materials[material]),
    };
  }));
  const images = await Promise.all((gltf.images || []).map(({bufferView, mimeType}) => {
    const {byteOffset, byteLength} = gltf.bufferViews[bufferView];
    const file = new Blob([bytes.slice(binary + byteOffset, binary + byteOffset + byteLength)], {type: mimeType});
    return createImageBitmap(file, {premultiplyAlpha: 'none', colorSpaceConversion: 'none'});
  }));
  return {meshes, nodes: gltf.nodes, images};
}

/** Returns the page's data with each panel's poses in `tracks`, `meshes`, `images`, and each body's mesh. */
async function readRecording() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const bytes = await embeddedBytes();
  const {meshes, nodes, images} = await modelsFrom(bytes.subarray(0, data.glb_size));
  Object.assign(data, {meshes, images});
  // Skip node 0, the ground: the painter draws its own.
  data.bodies.forEach((body, i) => { body.mesh = nodes[1 + i].mesh; });
  let at = data.glb_size;
  const next = (frames) => {
    const {values, end} = posesFrom(bytes, at, frames, data.bodies.length, data.unit, data.turn_parts);
    at = end;
    return {frames, values};
  };
  data.tracks = data.panels.map((panel) => panel.reference ? null : next(panel.frames));
  if (data.reference) data.reference.track = next(data.reference.frames);
  data.tracks = data.tracks.map((track) => track || data.reference.track);
  return data;
}

/** Returns the seven numbers of a body's pose at frame k of a track, or at its last. */
function poseAt(data, track, k, body) {
  const frame = Math.max(0, Math.min(k, track.frames - 1));
  const start = (frame * data.bodies.length + body) * 7;
  return track.values.subarray(start, start + 7);
}

/** Returns v turned by the quaternion in pose[3…6], (x, y, z, w). */
function turned(pose, v) {
  const [x, y, z, w] = [pose[3], pose[4], pose[5], pose[6]];
  const tx = 2 * (y * v[2] - z * v[1]);
  const ty = 2 * (z * v[0] - x * v[2]);
  const tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

/** Returns a point of a body in world coordinates. */
function placed(pose, point) {
  const v = turned(pose, point);
  return [v[0] + pose[0], v[1] + pose[1], v[2] + pose[2]];
}

/** Returns the RMS distance of the body's points from the reference's, m: squared_distance() of the program. */
function bodyError(data, track, k, body) {
  const actual = poseAt(data, track, k, body);
  const expected = poseAt(data, data.reference.track, k, body);
  let sum = 0;
  for (let i = 0; i < 3; ++i) sum += (actual[i] - expected[i]) ** 2;
  const [a, b, c, d] = [-expected[3], -expected[4], -expected[5], expected[6]];
  const [x, y, z, w] = [actual[3], actual[4], actual[5], actual[6]];
  const between = [d * x + a * w + b * z - c * y, d * y + b * w + c * x - a * z, d * z + c * w + a * y - b * x];
  for (let i = 0; i < 3; ++i) sum += 4 * data.bodies[body].squared_gyration_radius[i] * between[i] ** 2;
  return Math.sqrt(sum);
}

/** Returns "1.23", "12.3", "123". */
const threeDigits = (value) => value.toFixed(value < 9.995 ? 2 : value < 99.95 ? 1 : 0);

/** Returns "1.23 m", "45.6 mm", "7.80 µm", as in the films. */
function lengthLabel(metres) {
  if (metres >= 1e6) return '> 1000 km';
  for (const [size, name] of [[1e3, 'km'], [1, 'm'], [1e-3, 'mm'], [1e-6, 'µm']]) {
    const value = metres / size;
    if (value >= 0.9995) return `${threeDigits(value)} ${name}`;
  }
  return metres > 0 ? '< 1 µm' : '0';
}
