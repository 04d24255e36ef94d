// MuJoCo 3: reduced coordinates, soft contacts, Newton's solver and every setting as it ships. Joints that close a loop are
// equality constraints.
import loadMujoco from '@mujoco/mujoco';
import { Refusal, add, combined, dot, product, scaled, simulate, subtract } from './adapter.mjs';

const words = (numbers) => numbers.join(' ');
const y_to_z = [Math.SQRT1_2, -Math.SQRT1_2, 0, 0];

/** How each body hangs on another: the joints that make a tree, parents first, and those that close its loops. */
function tree_of(scene) {
  const links = [];
  const closing = [];
  const placed = new Set(scene.bodies.filter((body) => body.kind === 'static'));
  const used = new Set();
  const follow = (reached) => {
    while (reached.length > 0) {
      const parent = reached.shift();
      for (const joint of scene.joints) {
        if (used.has(joint) || (joint.a !== parent && joint.b !== parent)) continue;
        used.add(joint);
        const child = joint.a === parent ? joint.b : joint.a;
        if (placed.has(child)) {
          if (child.kind !== 'static') closing.push(joint);
          continue;
        }
        placed.add(child);
        links.push({ body: child, parent, joint });
        reached.push(child);
      }
    }
  };
  follow([...placed]);
  for (const body of scene.bodies) {
    if (placed.has(body)) continue;
    placed.add(body);
    links.push({ body, parent: scene.bodies[0], joint: null });
    follow([body]);
  }
  return { links, closing };
}

/** The scene in MuJoCo's language. Body i is called "b<i>", unit i's colliders are "g<i>.<k>". */
class Model {
  constructor(scene, settings) {
    this.scene = scene;
    this.assets = [];
    this.contact = [];
    if (!scene.gyroscopic) throw new Refusal("MuJoCo's gyroscopic term cannot be left out");
    for (const body of scene.bodies) {
      if (body.kind === 'kinematic') throw new Refusal(`${body.name} is a kinematic body that moves`);
      if (body.kind === 'dynamic' && body.inertia.includes(null)) {
        throw new Refusal(`${body.name} has an infinite moment of inertia`);
      }
    }
    Object.assign(this, tree_of(scene));
    const fixed = scene.units.map((unit, i) => (unit.body.kind === 'static'
      ? `<body name="u${i}" pos="${words(unit.body.position)}">${this.colliders(i)}</body>` : ''));
    const moving = this.links.filter(({ parent }) => parent.kind === 'static').map((link) => this.body(link, [0, 0, 0]));
    const closing = this.closing.map((joint) => this.equality(joint));
    this.add_pairs();
    this.text = `<mujoco><compiler angle="radian" inertiafromgeom="false" boundmass="0" boundinertia="0"/>
      <option timestep="${settings.step}" gravity="${words(scene.gravity)}"><flag filterparent="disable"/></option>
      <asset>${this.assets.join('')}</asset><worldbody>${fixed.join('')}${moving.join('')}</worldbody>
      <equality>${closing.join('')}</equality><contact>${this.contact.join('')}</contact><size memory="256M"/></mujoco>`;
  }

  collider(c, name) {
    const turned = c.orientation && product(c.orientation, y_to_z);
    const at = (orientation) => `pos="${words(c.position)}" quat="${words(orientation)}"`;
    const half = c.height / 2;
    const shape = () => {
      switch (c.shape) {
        case 'box': return `type="box" size="${words(scaled(c.size, 0.5))}" ${at(c.orientation)}`;
        case 'sphere': return `type="sphere" size="${c.radius}" ${at(c.orientation)}`;
        case 'capsule': return `type="capsule" size="${c.radius} ${half}" ${at(turned)}`;
        case 'plane': return `type="plane" size="0 0 1" ${at(turned)}`;
        case 'triangle mesh': throw new Refusal('a collider is a triangle mesh, which MuJoCo would replace by its hull');
        case 'ellipsoid': return `type="ellipsoid" size="${words(c.halfAxes)}" ${at(c.orientation)}`;
        case 'cylinder':
          if (c.radiusBottom === c.radiusTop) return `type="cylinder" size="${c.radiusTop} ${half}" ${at(turned)}`;
      }
      // MuJoCo moves a mesh to its centre of mass, and its collider back.
      this.assets.push(`<mesh name="${name}" vertex="${words(c.points.flat())}"/>`);
      return `type="mesh" mesh="${name}"`;
    };
    return `<geom name="${name}" ${shape()} friction="${c.material.dynamicFriction} 0 0" condim="3"/>`;
  }

  colliders(index) {
    return this.scene.units[index].colliders.map((c, k) => this.collider(c, `g${index}.${k}`)).join('');
  }

  body({ body, parent, joint }, from) {
    const point = joint && words(joint.a === body ? joint.point_a : joint.point_b);
    let degrees = `<freejoint name="j${body.index}"/>`;
    if (joint?.kind === 'fixed') degrees = '';
    if (joint?.kind === 'ball') degrees = `<joint name="j${body.index}" type="ball" pos="${point}"/>`;
    if (joint?.kind === 'hinge') {
      // Limits are those of b in a.
      const axis = joint.b === body ? joint.axis : scaled(joint.axis, -1);
      const wide = joint.limits?.map((limit) => Math.max(-1e3, Math.min(1e3, limit)));
      degrees = `<joint name="j${body.index}" type="hinge" pos="${point}" axis="${words(axis)}" ${
        wide ? `limited="true" range="${words(wide)}"` : ''}/>`;
    }
    const children = this.links.filter((link) => link.parent === body).map((link) => this.body(link, body.position));
    return `<body name="b${body.index}" pos="${words(subtract(body.position, from))}" gravcomp="${1 - body.gravityFactor}">
      <inertial pos="0 0 0" quat="${words(body.inertiaOrientation)}" mass="${body.mass}" diaginertia="${words(body.inertia)}"/>
      ${degrees}${this.colliders(body.index - 1)}${children.join('')}</body>`;
  }

  equality({ a, b, kind, point_a, axis }) {
    const names = `body1="b${a.index}"${b.kind === 'static' ? '' : ` body2="b${b.index}"`}`;
    if (a.kind === 'static') return this.equality({ a: b, b: a, kind, point_a: subtract(add(point_a, a.position), b.position), axis });
    const connect = (anchor) => `<connect ${names} anchor="${words(anchor)}"/>`;
    if (kind === 'fixed') return `<weld ${names}/>`;
    return connect(point_a) + (kind === 'hinge' ? connect(add(point_a, axis)) : '');
  }

  /** Leaves out pairs that do not meet, and names those whose friction is not MuJoCo's maximum of the two. */
  add_pairs() {
    const { units } = this.scene;
    const name = (i) => (units[i].body.kind === 'static' ? `u${i}` : `b${i + 1}`);
    for (let i = 0; i < units.length; ++i) {
      for (let j = i + 1; j < units.length; ++j) {
        if (units[i].body.kind === 'static' && units[j].body.kind === 'static') continue;
        if (!this.scene.meet(i, j)) {
          this.contact.push(`<exclude body1="${name(i)}" body2="${name(j)}"/>`);
          continue;
        }
        units[i].colliders.forEach((one, k) => units[j].colliders.forEach((other, l) => {
          if (combined(one, other, 'restitution') !== 0) throw new Refusal('there is restitution');
          const friction = combined(one, other, 'friction');
          if (friction === Math.max(one.material.dynamicFriction, other.material.dynamicFriction)) return;
          this.contact.push(`<pair geom1="g${i}.${k}" geom2="g${j}.${l}" condim="3" friction="${friction} ${friction} 0 0 0"/>`);
        }));
      }
    }
  }
}

/** The velocities of a link's joint at the start, as MuJoCo has them. */
function start_velocities({ body, parent, joint }) {
  if (!joint) return [...body.linearVelocity, ...body.angularVelocity];
  const spin = subtract(body.angularVelocity, parent.angularVelocity);
  if (joint.kind === 'ball') return spin;
  return joint.kind === 'hinge' ? [dot(spin, joint.axis) * (joint.b === body ? 1 : -1)] : [];
}

const mujoco = await loadMujoco();
await simulate((scene, settings) => {
  const made = new Model(scene, settings);
  let model;
  try {
    model = mujoco.MjModel.from_xml_string(made.text);
  } catch (error) {
    throw new Refusal(`MuJoCo refuses it: ${error.message ?? mujoco.getExceptionMessage?.(error) ?? error}`);
  }
  const data = new mujoco.MjData(model);
  const ids = new Map();
  for (const link of made.links) {
    const id = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, `b${link.body.index}`);
    start_velocities(link).forEach((value, k) => { data.qvel[model.body_dofadr[id] + k] = value; });
    ids.set(link.body, id);
  }
  mujoco.mj_forward(model, data);
  const velocity = new mujoco.DoubleBuffer(6);
  return {
    step: () => {
      mujoco.mj_step(model, data);
      // A step leaves the bodies where it found them.
      mujoco.mj_kinematics(model, data);
      mujoco.mj_comPos(model, data);
      mujoco.mj_comVel(model, data);
    },
    state: (body) => {
      const index = ids.get(body);
      mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY.value, index, velocity, 0);
      const v = velocity.GetView();
      return { position: [...data.xpos.slice(3 * index, 3 * index + 3)],
        orientation: [...data.xquat.slice(4 * index, 4 * index + 4)], velocity: [...v.slice(3)], spin: [...v.slice(0, 3)] };
    },
  };
});
