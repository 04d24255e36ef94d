#include <ode/ode.h>

#include <cmath>
#include <mutex>

#include "sim/error.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {
namespace {

constexpr int most_contacts = 8;  // a box on a box, turned by 45 degrees

void start_ode() {
  static std::once_flag once;
  std::call_once(once, [] {
    dInitODE2(0);
    dSetMessageHandler([](int, const char*, va_list) {});  // dWorldStep prints when its LCP fails
  });
  dAllocateODEDataForThread(dAllocateMaskAll);
}

class OdeStepper final : public Stepper {
 public:
  OdeStepper(const Scene& scene, const EngineScene& shared, const Settings& settings, bool quick)
      : step_(settings.step), quick_(quick), state_(initial_state(scene)) {
    friction_ = shared.friction;
    start_ode();
    world_ = dWorldCreate();
    // Give each world its own list of jobs: worlds that share one abort when two are stepped at once.
    jobs_ = dThreadingAllocateSelfThreadedImplementation();
    dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(jobs_), jobs_);
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
    if (quick) dWorldSetQuickStepNumIterations(world_, settings.iterations);
    bodies_.resize(scene.bodies.size(), nullptr);
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
      if (scene.bodies[i].inverse_mass > 0) add(scene.bodies[i], scene.gyroscopic, bodies_[i]);
    }
    if (shared.has_contacts) {
      for (const Collider& collider : scene.colliders) add(scene, collider);
    }
    for (const EngineJoint& joint : shared.joints) add(scene, joint);
  }
  ~OdeStepper() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    dThreadingFreeImplementation(jobs_);
  }
  OdeStepper(const OdeStepper&) = delete;
  OdeStepper& operator=(const OdeStepper&) = delete;

  bool step() override {
    dSpaceCollide(space_, this, &OdeStepper::collide);
    if (quick_) {
      // ODE shuffles its rows by random numbers that all worlds share. Each world continues its own sequence,
      // so that a run does not depend on others.
      static std::mutex drawing;
      const std::lock_guard lock(drawing);
      dRandSetSeed(seed_);
      dWorldQuickStep(world_, step_);
      seed_ = dRandGetSeed();
    } else {
      dWorldStep(world_, step_);
    }
    dJointGroupEmpty(contacts_);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i]) continue;
      const dReal* p = dBodyGetPosition(bodies_[i]);
      const dReal* q = dBodyGetQuaternion(bodies_[i]);
      const dReal* v = dBodyGetLinearVel(bodies_[i]);
      const dReal* w = dBodyGetAngularVel(bodies_[i]);
      next_.q[i] = {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}};
      next_.v[i] = {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
    }
    if (!is_finite(next_)) return false;
    state_ = next_;
    return true;
  }
  const State& state() const override { return state_; }

 private:
  void add(const Body& body, bool gyroscopic, dBodyID& id) {
    id = dBodyCreate(world_);
    dMass mass;
    const Vector3 inertia = body.inverse_inertia.cwiseInverse();
    dMassSetParameters(&mass, 1 / body.inverse_mass, 0, 0, 0, inertia.x(), inertia.y(), inertia.z(), 0, 0, 0);
    dBodySetMass(id, &mass);
    const Vector3& p = body.pose.position;
    const Quaternion& o = body.pose.orientation;
    const dQuaternion q = {o.w(), o.x(), o.y(), o.z()};
    dBodySetPosition(id, p.x(), p.y(), p.z());
    dBodySetQuaternion(id, q);
    const Vector3& v = body.linear_velocity;
    const Vector3& w = body.angular_velocity;
    dBodySetLinearVel(id, v.x(), v.y(), v.z());
    dBodySetAngularVel(id, w.x(), w.y(), w.z());
    dBodySetGyroscopicMode(id, gyroscopic);
    dBodySetAutoDisableFlag(id, 0);
  }

  void add(const Scene& scene, const Collider& collider) {
    const dBodyID body = bodies_[collider.body];
    Pose placement = body ? collider.placement : scene.bodies[collider.body].pose * collider.placement;
    // ODE's capsules lie along z.
    const Quaternion y_to_z(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);
    dGeomID geometry = nullptr;
    if (const auto* polytope = std::get_if<Polytope>(&collider.shape); polytope && polytope->half_box) {
      const Vector3 size = 2 * *polytope->half_box;
      geometry = dCreateBox(space_, size.x(), size.y(), size.z());
    } else if (const auto* sphere = std::get_if<Sphere>(&collider.shape)) {
      geometry = dCreateSphere(space_, sphere->radius);
    } else if (const auto* capsule = std::get_if<Capsule>(&collider.shape)) {
      geometry = dCreateCapsule(space_, capsule->radius, 2 * capsule->half_length);
      placement.orientation = placement.orientation * y_to_z;
    } else if (std::holds_alternative<Plane>(collider.shape) && !body) {
      const Vector3 normal = placement.orientation * Vector3::UnitY();
      dCreatePlane(space_, normal.x(), normal.y(), normal.z(), normal.dot(placement.position));
      return;
    } else {
      throw Error("a collider is no box, sphere, capsule or fixed plane");
    }
    const Vector3& p = placement.position;
    const Quaternion& o = placement.orientation;
    const dQuaternion q = {o.w(), o.x(), o.y(), o.z()};
    if (body) {
      dGeomSetBody(geometry, body);
      dGeomSetOffsetPosition(geometry, p.x(), p.y(), p.z());
      dGeomSetOffsetQuaternion(geometry, q);
    } else {
      dGeomSetPosition(geometry, p.x(), p.y(), p.z());
      dGeomSetQuaternion(geometry, q);
    }
  }

  void add(const Scene& scene, const EngineJoint& joint) {
    const Pose& pose = scene.bodies[joint.a].pose;
    const Vector3 anchor = pose * joint.anchor_a;
    const Vector3 axis = pose.orientation * joint.axis_a;
    dJointID made = nullptr;
    switch (joint.kind) {
      case EngineJoint::Kind::ball:
        made = dJointCreateBall(world_, nullptr);
        dJointAttach(made, bodies_[joint.a], bodies_[joint.b]);
        dJointSetBallAnchor(made, anchor.x(), anchor.y(), anchor.z());
        break;
      case EngineJoint::Kind::hinge:
        made = dJointCreateHinge(world_, nullptr);
        dJointAttach(made, bodies_[joint.a], bodies_[joint.b]);
        dJointSetHingeAnchor(made, anchor.x(), anchor.y(), anchor.z());
        dJointSetHingeAxis(made, axis.x(), axis.y(), axis.z());
        break;
      case EngineJoint::Kind::fixed:
        made = dJointCreateFixed(world_, nullptr);
        dJointAttach(made, bodies_[joint.a], bodies_[joint.b]);
        dJointSetFixed(made);
        break;
    }
  }

  static void collide(void* data, dGeomID one, dGeomID other) {
    const OdeStepper& self = *static_cast<OdeStepper*>(data);
    const dBodyID a = dGeomGetBody(one);
    const dBodyID b = dGeomGetBody(other);
    if (a == b || (a && b && dAreConnectedExcluding(a, b, dJointTypeContact))) return;
    dContact found[most_contacts];
    const int count = dCollide(one, other, most_contacts, &found[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      found[i].surface.mode = dContactApprox1;  // Coulomb's limits, from the normal's impulse
      found[i].surface.mu = self.friction_;
      dJointAttach(dJointCreateContact(self.world_, self.contacts_, &found[i]), a, b);
    }
  }

  double step_;
  bool quick_;
  State state_;
  State next_ = state_;
  dWorldID world_ = nullptr;
  dThreadingImplementationID jobs_ = nullptr;
  unsigned long seed_ = 0;
  dSpaceID space_ = nullptr;
  dJointGroupID contacts_ = nullptr;
  std::vector<dBodyID> bodies_;
  double friction_ = 0;
};

}  // namespace

Stepper* make_engine_stepper(const Scene& scene, const EngineScene& shared, const Settings& settings,
                             const std::string& solver) {
  return std::make_unique<OdeStepper>(scene, shared, settings, solver == "QuickStep").release();
}

}  // namespace substep
