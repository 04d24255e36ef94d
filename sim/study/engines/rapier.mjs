// Rapier: every setting as it ships, but solver iterations as asked for, no sleep, and forces' time step.
import RAPIER from '@dimforge/rapier3d-compat';
import { Refusal, simulate } from './adapter.mjs';

const vector = ([x, y, z]) => ({ x, y, z });
const quaternion = ([w, x, y, z]) => ({ w, x, y, z });
const list = ({ x, y, z }) => [x, y, z];

function shape_of(c) {
  const flat = () => Float32Array.from(c.points.flat());
  switch (c.shape) {
    case 'box': return RAPIER.ColliderDesc.cuboid(...c.size.map((side) => side / 2));
    case 'sphere': return RAPIER.ColliderDesc.ball(c.radius);
    case 'capsule': return RAPIER.ColliderDesc.capsule(c.height / 2, c.radius);
    case 'plane': return new RAPIER.ColliderDesc(new RAPIER.HalfSpace(vector([0, 1, 0])));
    case 'triangle mesh': return RAPIER.ColliderDesc.trimesh(flat(), Uint32Array.from(c.indices.flat()));
    case 'cylinder':
      if (c.radiusBottom === c.radiusTop) return RAPIER.ColliderDesc.cylinder(c.height / 2, c.radiusTop);
  }
  const hull = RAPIER.ColliderDesc.convexHull(flat());
  if (!hull) throw new Refusal(`Rapier makes no hull of a ${c.shape}`);
  return hull;
}

/** Whether the shape's points are those of its body, so that it needs no place of its own. */
const is_placed = (c) => c.position !== undefined && (c.shape !== 'ellipsoid') && (c.shape !== 'tapered capsule') &&
  !(c.shape === 'cylinder' && c.radiusBottom !== c.radiusTop);

function body_of(world, body) {
  const desc = {
    dynamic: RAPIER.RigidBodyDesc.dynamic, kinematic: RAPIER.RigidBodyDesc.kinematicVelocityBased,
    static: RAPIER.RigidBodyDesc.fixed,
  }[body.kind]();
  desc.setTranslation(...body.position).setLinvel(...body.linearVelocity).setAngvel(vector(body.angularVelocity));
  desc.setCanSleep(false);
  if (body.kind === 'dynamic') {
    // 0 is infinite.
    desc.setGravityScale(body.gravityFactor).setAdditionalMassProperties(body.mass, vector([0, 0, 0]),
      vector(body.inertia.map((moment) => moment ?? 0)), quaternion(body.inertiaOrientation));
  }
  return world.createRigidBody(desc);
}

await RAPIER.init();
await simulate((scene, settings) => {
  const unequal = scene.bodies.some((body) => body.kind === 'dynamic' && new Set(body.inertia).size > 1);
  if (unequal && !scene.gyroscopic) throw new Refusal("Rapier's gyroscopic term cannot be left out");
  const rules = { average: RAPIER.CoefficientCombineRule.Average, minimum: RAPIER.CoefficientCombineRule.Min,
    maximum: RAPIER.CoefficientCombineRule.Max, multiply: RAPIER.CoefficientCombineRule.Multiply };
  const world = new RAPIER.World(vector(scene.gravity));
  world.timestep = settings.step;
  world.numSolverIterations = settings.iterations;
  const bodies = scene.bodies.map((body) => body_of(world, body));
  const units = new Map();
  const ways = { friction: new Set(), restitution: new Set() };
  scene.units.forEach((unit, index) => {
    for (const c of unit.colliders) {
      // Rapier's average yields to its other rules, as a mode that is not stated does.
      const modes = {};
      for (const what of ['friction', 'restitution']) {
        const stated = c.material[`${what}Combine`];
        if (stated) ways[what].add(stated);
        modes[what] = rules[stated ?? 'average'];
      }
      const desc = shape_of(c).setDensity(0)
        .setFriction(c.material.dynamicFriction).setFrictionCombineRule(modes.friction)
        .setRestitution(c.material.restitution).setRestitutionCombineRule(modes.restitution)
        .setActiveHooks(RAPIER.ActiveHooks.FILTER_CONTACT_PAIRS);
      if (is_placed(c)) desc.setTranslation(...c.position).setRotation(quaternion(c.orientation));
      units.set(world.createCollider(desc, bodies[unit.body.index]).handle, index);
    }
  });
  if (Math.max(ways.friction.size, ways.restitution.size) > 1) {
    throw new Refusal('materials combine in several ways, of which Rapier prefers others');
  }
  for (const joint of scene.joints) {
    const [a, b] = [vector(joint.point_a), vector(joint.point_b)];
    const still = quaternion([1, 0, 0, 0]);
    const data = { ball: () => RAPIER.JointData.spherical(a, b), fixed: () => RAPIER.JointData.fixed(a, still, b, still),
      hinge: () => RAPIER.JointData.revolute(a, b, vector(joint.axis)) }[joint.kind]();
    const made = world.createImpulseJoint(data, bodies[joint.a.index], bodies[joint.b.index], true);
    if (joint.limits) made.setLimits(...joint.limits.map((limit) => Math.max(-1e6, Math.min(1e6, limit))));
  }
  const filters = scene.units.some((_, i) => scene.units.some((__, j) => i < j && !scene.meet(i, j)));
  const hooks = filters ? { filterContactPair: (one, other) => (scene.meet(units.get(one), units.get(other))
    ? RAPIER.SolverFlags.COMPUTE_IMPULSE : null), filterIntersectionPair: () => true } : undefined;
  return {
    step: () => world.step(undefined, hooks),
    state: (body) => {
      const is = bodies[body.index];
      const q = is.rotation();
      return { position: list(is.translation()), orientation: [q.w, q.x, q.y, q.z], velocity: list(is.linvel()),
        spin: list(is.angvel()) };
    },
  };
});
