// Vectors, views, and projections of points.

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, f = 1) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const crossed = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const l = Math.hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };
/** Returns two axes perpendicular to a unit direction. */
const across = (forward) => {
  const right = unit(crossed(forward, Math.abs(forward[1]) > 0.99 ? [0, 0, 1] : [0, 1, 0]));
  return {right, up: crossed(right, forward)};
};

/** Returns the clip matrix by columns: rows are right, up and forward, scaled and shifted; w is the depth if `perspective`. */
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

/** A camera that orbits a point, shared by all panels. */
class Camera {
  constructor({eye, target, tangent, side}) {
    this.first = {eye, target};
    this.tangent = tangent;
    this.side = side;
    this.home = Math.hypot(...minus(eye, target));
    this.reset();
  }

  reset() {
    const offset = minus(this.first.eye, this.first.target);
    this.target = [...this.first.target];
    this.distance = this.home;
    this.yaw = Math.atan2(offset[0], offset[2]);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, offset[1] / this.home)));
  }

  /** Returns the axes right, up and forward. */
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return {forward: [-sy * cp, -sp, -cy * cp], right: [cy, 0, -sy], up: [-sy * sp, cp, -cy * sp]};
  }

  /** Returns the view for a picture's box: as high as the film's, or higher where the box is narrow. */
  view(box) {
    const {forward, right, up} = this.axes();
    const aspect = box[2] / box[3];
    const y = Math.max(this.tangent, this.side / aspect);
    const x = y * aspect;
    const eye = plus(this.target, forward, -this.distance);
    const reach = 40 * this.distance;
    const near = Math.min(0.02 * this.distance, Math.max(0.1, 0.002 * this.distance));
    const clip = clipFrom({eye, right, up, forward, x, y, near, far: 2.5 * reach, perspective: true});
    return {eye, forward, right, up, x, y, reach, clip, box};
  }

  orbit(dx, dy) {
    this.yaw -= 0.008 * dx;
    this.pitch = Math.max(-1.5, Math.min(1.55, this.pitch + 0.008 * dy));
  }

  /** Moves the target by pixels of a picture. */
  pan(dx, dy, picture) {
    const {right, up, y} = this.view([0, 0, picture.clientWidth, picture.clientHeight]);
    const step = 2 * y * this.distance / picture.clientHeight;
    this.target = plus(plus(this.target, right, -dx * step), up, dy * step);
  }

  zoom(factor) {
    this.distance = Math.max(0.02 * this.home, Math.min(30 * this.home, this.distance * factor));
  }
}

/** Returns a point's position in pixels from the picture's top left corner; null behind the eye. */
function projected(view, point, width, height) {
  const p = minus(point, view.eye);
  const ahead = dot(p, view.forward);
  if (!(ahead > 0)) return null;
  const at = [width * (0.5 + 0.5 * dot(p, view.right) / (ahead * view.x)), height * (0.5 - 0.5 * dot(p, view.up) / (ahead * view.y))];
  return Math.abs(at[0]) < 1e5 && Math.abs(at[1]) < 1e5 ? at : null;
}
