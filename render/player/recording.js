// What the page holds: the runs' poses, and the bodies' meshes as binary glTF.

/** The bytes of the page's element `bytes`. */
async function embeddedBytes() {
  const text = document.getElementById('bytes').textContent;
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The inverse of pose_stream(): seven numbers a body and frame, the world at rest. Returns them and where it ended. */
function posesFrom(bytes, start, frames, bodies, unit, turnParts) {
  const values = new Float32Array(frames * bodies * 7);
  for (let k = 0; k < frames; ++k) values[k * bodies * 7 + 6] = 1;
  let at = start;
  for (let body = 1; frames > 0 && body < bodies; ++body) {
    for (let i = 0; i < 7; ++i) {
      const part = i < 3 ? unit : 1 / turnParts;
      let whole = 0;
      for (let k = 0; k < frames; ++k) {
        // Not by shifts, which end at 32 bits.
        let zigzag = 0;
        let place = 1;
        for (;; place *= 128) {
          const byte = bytes[at++];
          zigzag += (byte & 127) * place;
          if (byte < 128) break;
        }
        whole += zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
        values[(k * bodies + body) * 7 + i] = whole * part;
      }
    }
  }
  return {values, end: at};
}

/** Triangles of binary glTF, as animated_glb() writes it: [{body, positions, normals, indices, color, metallic, roughness}]. */
function primitivesFrom(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const jsonSize = view.getUint32(12, true);
  const gltf = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + jsonSize)));
  const binary = 28 + jsonSize;
  const kinds = {5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array};
  const widths = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4};
  const read = (index) => {
    const accessor = gltf.accessors[index];
    const part = gltf.bufferViews[accessor.bufferView];
    const Kind = kinds[accessor.componentType];
    const begin = binary + (part.byteOffset || 0) + (accessor.byteOffset || 0);
    const size = accessor.count * widths[accessor.type] * Kind.BYTES_PER_ELEMENT;
    return new Kind(bytes.slice(begin, begin + size).buffer);
  };
  const meshes = gltf.meshes.map((mesh) => mesh.primitives.map((primitive) => {
    const material = (gltf.materials || [])[primitive.material] || {};
    const {baseColorFactor = [1, 1, 1, 1], metallicFactor = 1, roughnessFactor = 1} = material.pbrMetallicRoughness || {};
    const positions = read(primitive.attributes.POSITION);
    return {
      positions,
      normals: read(primitive.attributes.NORMAL),
      indices: 'indices' in primitive ? Uint32Array.from(read(primitive.indices)) : Uint32Array.from({length: positions.length / 3}, (_, i) => i),
      color: baseColorFactor.slice(0, 3), metallic: metallicFactor, roughness: roughnessFactor,
    };
  }));
  return {meshes, nodes: gltf.nodes};
}

/** All of the page: data, and with it `tracks` (a panel's poses), `meshes`, and which of these each body has. */
async function readRecording() {
  const data = JSON.parse(document.getElementById('data').textContent);
  const bytes = await embeddedBytes();
  const {meshes, nodes} = primitivesFrom(bytes.subarray(0, data.glb_size));
  // Node 0 is the ground, which the painter has its own of.
  data.meshes = meshes;
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

/** Seven numbers of a body at frame k of a track; where it ends before, at its end. */
function poseAt(data, track, k, body) {
  const frame = Math.max(0, Math.min(k, track.frames - 1));
  const start = (frame * data.bodies.length + body) * 7;
  return track.values.subarray(start, start + 7);
}

/** v turned by the quaternion in pose[3…6], (x, y, z, w). */
function turned(pose, v) {
  const [x, y, z, w] = [pose[3], pose[4], pose[5], pose[6]];
  const tx = 2 * (y * v[2] - z * v[1]);
  const ty = 2 * (z * v[0] - x * v[2]);
  const tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

/** Where a point of the body is in the world. */
function placed(pose, point) {
  const v = turned(pose, point);
  return [v[0] + pose[0], v[1] + pose[1], v[2] + pose[2]];
}

/** RMS distance of the body's points from where the reference has them, m: squared_distance() of the program. */
function bodyError(data, track, k, body) {
  const is = poseAt(data, track, k, body);
  const should = poseAt(data, data.reference.track, k, body);
  let sum = 0;
  for (let i = 0; i < 3; ++i) sum += (is[i] - should[i]) ** 2;
  const [a, b, c, d] = [-should[3], -should[4], -should[5], should[6]];
  const [x, y, z, w] = [is[3], is[4], is[5], is[6]];
  const between = [d * x + a * w + b * z - c * y, d * y + b * w + c * x - a * z, d * z + c * w + a * y - b * x];
  for (let i = 0; i < 3; ++i) sum += 4 * data.bodies[body].radius[i] * between[i] ** 2;
  return Math.sqrt(sum);
}

/** "1.23 m", "45.6 mm", "7.8 µm": as the films have it. */
function lengthLabel(metres) {
  if (metres >= 1e6) return '> 1000 km';
  for (const [size, name] of [[1e3, 'km'], [1, 'm'], [1e-3, 'mm'], [1e-6, 'µm']]) {
    const value = metres / size;
    if (value >= 0.9995) return `${value.toFixed(value < 9.995 ? 2 : value < 99.95 ? 1 : 0)} ${name}`;
  }
  return metres > 0 ? '< 1 µm' : '0';
}
