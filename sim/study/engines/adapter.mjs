// Shared by the engines' adapters: the scene in frames that have the world's axes when it starts, and the pose table.
// scenes/format.md documents both files. An adapter calls simulate() with a function that makes a world.
import { closeSync, openSync, readFileSync, writeSync } from 'node:fs';

/** The refusal of a scene that the engine cannot represent; the program prints its message. */
export class Refusal extends Error {}

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const subtract = (a, b) => a.map((x, i) => x - b[i]);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const scaled = (a, factor) => a.map((x) => x * factor);
export const unit = (a) => scaled(a, 1 / Math.hypot(...a));

// Quaternions are [w, x, y, z].
export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];
export const product = ([a, ...u], [b, ...v]) =>
  [a * b - dot(u, v), ...add(add(scaled(v, a), scaled(u, b)), cross(u, v))];
export const rotated = (q, v) => product(product(q, [0, ...v]), conjugate(q)).slice(1);

/** A unit vector at right angles to another. */
export const normal_of = (a) => unit(cross(a, Math.abs(a[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0]));

/** The collider with all that is in its body's frame turned by the body's orientation at the start. */
function turned_collider(collider, turn, moves) {
  const result = { ...collider, moves };
  if (collider.position) result.position = rotated(turn, collider.position);
  if (collider.orientation) result.orientation = product(turn, collider.orientation);
  if (collider.points) result.points = collider.points.map((point) => rotated(turn, point));
  if (collider.shape === 'cylinder' || collider.shape === 'tapered capsule') add_hull(result);
  return result;
}

/** Adds the hull's points to a cylinder or tapered capsule, for engines that lack the shape. */
function add_hull(collider) {
  const { height, radiusBottom, radiusTop, position, orientation } = collider;
  const round = [-75, -60, -45, -30, -15, 0, 15, 30, 45, 60, 75, 89];  // rings' latitudes, degrees
  collider.points = [];
  for (const [radius, y, side] of [[radiusBottom, -height / 2, -1], [radiusTop, height / 2, 1]]) {
    for (const degrees of collider.shape === 'cylinder' ? [0] : round) {
      const latitude = (degrees * Math.PI) / 180;
      const ring = radius * Math.cos(latitude);
      for (let k = 0; k < 32; ++k) {
        const angle = (k * Math.PI) / 16;
        const point = [ring * Math.cos(angle), y + side * radius * Math.sin(latitude), ring * Math.sin(angle)];
        collider.points.push(add(position, rotated(orientation, point)));
      }
    }
  }
}

/** A joint in terms that engines share: ball, hinge or fixed, at points relative to the bodies' centres. */
function shared_joint(joint, bodies) {
  const refuse = (why) => { throw new Refusal(`joint ${joint.name} ${why}`); };
  if (joint.drives.length > 0) refuse('has a drive');
  const [a, b] = joint.indices.map((index) => bodies[index]);
  const [frame_a, frame_b] = [a, b].map((body, side) => ({
    point: rotated(body.orientation, joint.frames[side].position),
    orientation: product(body.orientation, joint.frames[side].orientation),
  }));
  const locked = { linear: '', angular: '' };
  let range = null;
  for (const limit of joint.limits) {
    if (limit.stiffness !== null) refuse('has a spring');
    if (limit.min === 0 && limit.max === 0) {
      locked[limit.type] += limit.axes;
    } else if (limit.type === 'angular' && limit.axes.length === 1 && !range) {
      range = limit;
    } else {
      refuse(limit.type === 'linear' ? 'limits a slide' : limit.axes.length > 1 ? 'limits a cone' : 'limits two rotations');
    }
  }
  const free = [...'xyz'].filter((axis) => !locked.angular.includes(axis));
  if ([...'xyz'].some((axis) => !locked.linear.includes(axis)) || free.length === 2) {
    refuse('is no ball joint, hinge or fixed joint');
  }
  if (range && (free.length !== 1 || range.axes !== free[0])) refuse('limits a rotation of a ball joint');
  const kind = { 0: 'fixed', 1: 'hinge', 3: 'ball' }[free.length];
  const result = { name: joint.name, kind, a, b, point_a: frame_a.point, point_b: frame_b.point, limits: null,
    collide: joint.bodiesCollide, silent: joint.silentColliders };
  if (kind !== 'hinge') return result;
  const along = 'xyz'.indexOf(free[0]);
  const axis = [0, 0, 0];
  axis[along] = 1;
  result.axis = rotated(frame_a.orientation, axis);
  if (dot(result.axis, rotated(frame_b.orientation, axis)) < 1 - 1e-6) refuse('starts with axes that are not parallel');
  if (range) {
    // The engines' angle is 0 at the start.
    const between = product(conjugate(frame_a.orientation), frame_b.orientation);
    const start = 2 * Math.atan2(between[1 + along], between[0]);
    const wrapped = start - 2 * Math.PI * Math.round(start / (2 * Math.PI));
    result.limits = [(range.min ?? -Infinity) - wrapped, (range.max ?? Infinity) - wrapped];
  }
  return result;
}

/** The coefficient of two colliders: "friction" or "restitution". Of two combine modes the first of these wins;
    without a mode it is the average. */
export function combined(one, other, what) {
  const value = (collider) => collider.material[what === 'friction' ? 'dynamicFriction' : what];
  const [x, y] = [value(one), value(other)];
  const ways = { average: (x + y) / 2, minimum: Math.min(x, y), maximum: Math.max(x, y), multiply: x * y };
  const modes = [one, other].map((collider) => collider.material[`${what}Combine`]);
  return ways[Object.keys(ways).find((way) => modes.includes(way)) ?? 'average'];
}

/** Returns the scene in frames with the world's axes at the start, with units, and meet(i, j): whether two units collide. */
function in_world_axes(scene) {
  if (scene.format !== 'substep scene 1') throw new Error(`this adapter reads "substep scene 1", not "${scene.format}"`);
  const still = { linearVelocity: [0, 0, 0], angularVelocity: [0, 0, 0] };
  Object.assign(scene.bodies[0], { position: [0, 0, 0], orientation: [1, 0, 0, 0], kind: 'static', ...still });
  scene.bodies.forEach((body, index) => {
    body.index = index;
    if (body.kind === 'pivoting') throw new Refusal(`${body.name} has an infinite mass and a finite inertia`);
    if (body.kind === 'kinematic' && [...body.linearVelocity, ...body.angularVelocity].every((v) => v === 0)) {
      body.kind = 'static';
    }
    body.colliders = body.colliders.map((c) => turned_collider(c, body.orientation, body.kind !== 'static'));
    if (body.inertiaOrientation) body.inertiaOrientation = product(body.orientation, body.inertiaOrientation);
  });
  scene.joints = scene.joints.map((joint) => shared_joint(joint, scene.bodies));
  // A unit that collides is a body, or a collider of the world.
  scene.units = scene.bodies.slice(1).map((body) => ({ body, colliders: body.colliders }));
  for (const collider of scene.bodies[0].colliders) scene.units.push({ body: scene.bodies[0], colliders: [collider] });
  const silent = new Set();
  const silence = (one, other) => silent.add(`${one} ${other}`).add(`${other} ${one}`);
  for (const { a, b, collide, silent: named } of scene.joints) {
    if (collide) continue;
    const world = scene.bodies.length - 1;
    if (a.index > 0 && b.index > 0) silence(a.index - 1, b.index - 1);
    else for (const collider of named) silence(Math.max(a.index, b.index) - 1, world + collider);
  }
  const lets = (one, other) => !(other.systems ?? []).length || other.systems.some((s) => !one.exceptSystems.includes(s));
  scene.meet = (i, j) => {
    if (i === j || silent.has(`${i} ${j}`)) return false;
    const answers = new Set();
    for (const one of scene.units[i].colliders) {
      for (const other of scene.units[j].colliders) answers.add(lets(one, other) && lets(other, one));
    }
    if (answers.size > 1) throw new Refusal('colliders of one body have several collision filters');
    return answers.has(true);
  };
  return scene;
}

/** Simulates the scene of the command line with the world that `make(scene, settings)` returns: { step(), state(body) }. */
export async function simulate(make) {
  const [scene_file, settings_file, poses_file] = process.argv.slice(2);
  if (!poses_file) {
    console.error('give SCENE SETTINGS POSES: scenes/format.md describes these files');
    process.exit(2);
  }
  const settings = JSON.parse(readFileSync(settings_file));
  let file;
  try {
    const scene = in_world_axes(JSON.parse(readFileSync(scene_file)));
    const world = await make(scene, settings);
    file = openSync(poses_file, 'w');
    writeSync(file, 't,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n');
    const dynamic = scene.bodies.filter((body) => body.kind === 'dynamic');
    const steps = Math.round(settings.duration / settings.step);
    for (let k = 0; k <= steps; ++k) {
      if (k > 0) world.step();
      // { position, orientation, velocity, spin }, in the world; the orientation since the start
      const states = dynamic.map((body) => (k === 0
        ? { position: body.position, orientation: [1, 0, 0, 0], velocity: body.linearVelocity, spin: body.angularVelocity }
        : world.state(body)));
      const rows = states.map((s, i) => [k * settings.step, `"${dynamic[i].name.replaceAll('"', '""')}"`, ...s.position,
        ...unit(product(s.orientation, dynamic[i].orientation)), ...s.velocity, ...s.spin]);
      // A world that blew up ends here.
      if (rows.some((row) => row.some((value) => typeof value === 'number' && !Number.isFinite(value)))) break;
      writeSync(file, rows.map((row) => `${row.join(',')}\n`).join(''));
    }
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    console.error(error.message);
    process.exitCode = 3;
  } finally {
    if (file !== undefined) closeSync(file);
  }
}
