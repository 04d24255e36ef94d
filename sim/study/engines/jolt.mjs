// Jolt: every setting as it ships, but the scene's gyroscopic terms and contact coefficients, velocity steps as asked
// for, no sleep, no damping, speeds up to 1e6, and convex radii of at most a tenth of a box's thinnest half.
import initJolt from 'jolt-physics';
import { Refusal, combined, normal_of, rotated, simulate } from './adapter.mjs';

const Jolt = await initJolt();
const vector = (v) => new Jolt.Vec3(...v);
const position_of = (v) => new Jolt.RVec3(...v);
const quaternion = ([w, x, y, z]) => new Jolt.Quat(x, y, z, w);
const list = (v) => [v.GetX(), v.GetY(), v.GetZ()];

/** The shape's settings, and where it is in its body. */
function shape_of(c) {
  const at = { position: c.position, orientation: c.orientation };
  switch (c.shape) {
    case 'box': {
      const half = c.size.map((side) => side / 2);
      return { ...at, settings: new Jolt.BoxShapeSettings(vector(half), Math.min(0.05, 0.1 * Math.min(...half))) };
    }
    case 'sphere': return { ...at, settings: new Jolt.SphereShapeSettings(c.radius) };
    case 'capsule': return { ...at, settings: new Jolt.CapsuleShapeSettings(c.height / 2, c.radius) };
    case 'plane': return { ...at, settings: new Jolt.PlaneShapeSettings(new Jolt.Plane(vector([0, 1, 0]), 0)) };
    case 'triangle mesh': throw new Refusal('a collider is a triangle mesh, which this adapter does not hand to Jolt');
  }
  const settings = new Jolt.ConvexHullShapeSettings();
  for (const point of c.points) settings.mPoints.push_back(vector(point));
  return { position: [0, 0, 0], orientation: [1, 0, 0, 0], settings };
}

/** One shape of all colliders, with its centre of mass at the body's. */
function compound_of(colliders) {
  const all = new Jolt.StaticCompoundShapeSettings();
  const shapes = colliders.map(shape_of);
  for (const s of shapes) all.AddShapeShapeSettings(vector(s.position), quaternion(s.orientation), s.settings, 0);
  let settings = all;
  if (shapes.length === 0) settings = new Jolt.EmptyShapeSettings();
  if (shapes.length === 1) {
    settings = new Jolt.RotatedTranslatedShapeSettings(vector(shapes[0].position), quaternion(shapes[0].orientation),
      shapes[0].settings);
  }
  const made = settings.Create();
  if (made.HasError()) throw new Refusal(`Jolt cannot make its shape: ${made.GetError().c_str()}`);
  const shape = made.Get();
  shape.AddRef();
  const off = list(shape.GetCenterOfMass());
  return Math.hypot(...off) < 1e-9 ? shape : new Jolt.OffsetCenterOfMassShape(shape, vector(off.map((x) => -x)));
}

/** The tensor of principal moments along the axes of an orientation. */
function inertia_of(body) {
  if (body.inertia.includes(null)) throw new Refusal(`${body.name} has an infinite moment of inertia`);
  const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => rotated(body.inertiaOrientation, axis));
  const result = Jolt.Mat44.prototype.sIdentity();
  for (let column = 0; column < 3; ++column) {
    const entries = [0, 1, 2].map((row) => axes.reduce((sum, axis, k) => sum + body.inertia[k] * axis[row] * axis[column], 0));
    result.SetColumn3(column, vector(entries));
  }
  return result;
}

function system_of(settings) {
  const init = new Jolt.JoltSettings();
  const layers = new Jolt.ObjectLayerPairFilterTable(1);
  layers.EnableCollision(0, 0);
  const broad = new Jolt.BroadPhaseLayerInterfaceTable(1, 1);
  broad.MapObjectToBroadPhaseLayer(0, new Jolt.BroadPhaseLayer(0));
  init.mObjectLayerPairFilter = layers;
  init.mBroadPhaseLayerInterface = broad;
  init.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(broad, 1, layers, 1);
  const jolt = new Jolt.JoltInterface(init);
  const shipped = jolt.GetPhysicsSystem().GetPhysicsSettings();
  shipped.mNumVelocitySteps = settings.iterations;
  jolt.GetPhysicsSystem().SetPhysicsSettings(shipped);
  return jolt;
}

function body_of(bodies, unit, filter, index, gyroscopic) {
  const { body } = unit;
  const motion = { dynamic: Jolt.EMotionType_Dynamic, kinematic: Jolt.EMotionType_Kinematic, static: Jolt.EMotionType_Static }[body.kind];
  const desc = new Jolt.BodyCreationSettings(compound_of(unit.colliders), position_of(body.position), quaternion([1, 0, 0, 0]), motion, 0);
  desc.mCollisionGroup = new Jolt.CollisionGroup(filter, 0, index);
  if (body.kind !== 'static') {
    desc.mLinearVelocity = vector(body.linearVelocity);
    desc.mAngularVelocity = vector(body.angularVelocity);
    desc.mLinearDamping = desc.mAngularDamping = 0;
    desc.mMaxLinearVelocity = desc.mMaxAngularVelocity = 1e6;
    desc.mAllowSleeping = false;
  }
  if (body.kind === 'dynamic') {
    desc.mGravityFactor = body.gravityFactor;
    desc.mApplyGyroscopicForce = gyroscopic;
    desc.mOverrideMassProperties = Jolt.EOverrideMassProperties_MassAndInertiaProvided;
    desc.mMassPropertiesOverride.mMass = body.mass;
    desc.mMassPropertiesOverride.mInertia = inertia_of(body);
  }
  const made = bodies.CreateBody(desc);
  bodies.AddBody(made.GetID(), Jolt.EActivation_Activate);
  return made;
}

function constraint_of(joint, bodies) {
  const data = new { ball: Jolt.PointConstraintSettings, hinge: Jolt.HingeConstraintSettings, fixed: Jolt.FixedConstraintSettings }[joint.kind]();
  data.mSpace = Jolt.EConstraintSpace_LocalToBodyCOM;
  data.mPoint1 = position_of(joint.point_a);
  data.mPoint2 = position_of(joint.point_b);
  if (joint.kind === 'hinge') {
    data.mHingeAxis1 = data.mHingeAxis2 = vector(joint.axis);
    data.mNormalAxis1 = data.mNormalAxis2 = vector(normal_of(joint.axis));
    if (joint.limits) {
      // Jolt's limits contain 0 and lie within half a turn.
      if (joint.limits[0] > 0 || joint.limits[1] < 0) throw new Refusal(`joint ${joint.name} starts beyond its limits`);
      data.mLimitsMin = Math.max(-Math.PI, joint.limits[0]);
      data.mLimitsMax = Math.min(Math.PI, joint.limits[1]);
    }
  }
  return data.Create(...[joint.a, joint.b].map((body) => (body.index > 0 ? bodies[body.index - 1] : Jolt.JoltInterface.prototype.sGetFixedToWorldBody())));
}

/** Sets the coefficients of contacts, which Jolt would combine in its own way. */
function listener_of(units, index_of) {
  const set_coefficients = (one, other, manifold, settings) => {
    const [a, b] = [one, other].map((body) => units[index_of.get(Jolt.wrapPointer(body, Jolt.Body).GetID().GetIndex())].colliders[0]);
    const contact = Jolt.wrapPointer(settings, Jolt.ContactSettings);
    contact.mCombinedFriction = combined(a, b, 'friction');
    contact.mCombinedRestitution = combined(a, b, 'restitution');
  };
  const listener = new Jolt.ContactListenerJS();
  listener.OnContactValidate = () => Jolt.ValidateResult_AcceptAllContactsForThisBodyPair;
  listener.OnContactAdded = listener.OnContactPersisted = set_coefficients;
  listener.OnContactRemoved = () => {};
  return listener;
}

await simulate((scene, settings) => {
  const { units } = scene;
  for (const unit of units) {
    if (new Set(unit.colliders.map((c) => JSON.stringify(c.material))).size > 1) {
      throw new Refusal(`${unit.body.name} has colliders of several materials`);
    }
  }
  const jolt = system_of(settings);
  const system = jolt.GetPhysicsSystem();
  system.SetGravity(vector(scene.gravity));
  const filter = new Jolt.GroupFilterTable(units.length);
  units.forEach((_, i) => units.forEach((__, j) => {
    if (i < j && !scene.meet(i, j)) filter.DisableCollision(i, j);
  }));
  const index_of = new Map();
  const bodies = units.map((unit, index) => {
    const made = body_of(system.GetBodyInterface(), unit, filter, index, scene.gyroscopic);
    index_of.set(made.GetID().GetIndex(), index);
    return made;
  });
  for (const joint of scene.joints) system.AddConstraint(constraint_of(joint, bodies));
  system.SetContactListener(listener_of(units, index_of));
  return {
    step: () => jolt.Step(settings.step, 1),
    state: (body) => {
      const engine_body = bodies[body.index - 1];
      const q = engine_body.GetRotation();
      return { position: list(engine_body.GetCenterOfMassPosition()), orientation: [q.GetW(), q.GetX(), q.GetY(), q.GetZ()],
        velocity: list(engine_body.GetLinearVelocity()), spin: list(engine_body.GetAngularVelocity()) };
    },
  };
});
