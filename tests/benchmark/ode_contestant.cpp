#include <ode/ode.h>

#include "tests/benchmark/contestant.h"

namespace substep::benchmark {
namespace {

constexpr int most_contacts = 8;  // a box on a box, turned by 45 degrees

class Ode final : public Contestant {
 public:
  Ode(const Scene& scene, double step, int iterations) : step_(step), iterations_(iterations) {
    dInitODE();
    dSetMessageHandler([](int, const char*, va_list) {});  // dWorldStep prints when its LCP fails
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
    if (iterations > 0) dWorldSetQuickStepNumIterations(world_, iterations);
    bodies_.push_back(nullptr);
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) add(scene.bodies[i]);
    for (const Collider& collider : scene.colliders) add(collider);
    for (const Joint& joint : scene.joints) {
      const dJointID ball = dJointCreateBall(world_, nullptr);
      dJointAttach(ball, bodies_[joint.body_a], bodies_[joint.body_b]);
      const Vector3 anchor = scene.bodies[joint.body_a].pose * joint.frame_a.position;
      dJointSetBallAnchor(ball, anchor.x(), anchor.y(), anchor.z());
    }
  }
  ~Ode() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    dCloseODE();
  }
  Ode(const Ode&) = delete;
  Ode& operator=(const Ode&) = delete;

  void step() override {
    dSpaceCollide(space_, this, &Ode::collide);
    if (iterations_ > 0) {
      dWorldQuickStep(world_, step_);
    } else {
      dWorldStep(world_, step_);
    }
    dJointGroupEmpty(contacts_);
  }
  Vector3 position(int body) const override {
    const dReal* p = dBodyGetPosition(bodies_[body]);
    return {p[0], p[1], p[2]};
  }

 private:
  void add(const Body& body) {
    const dBodyID id = dBodyCreate(world_);
    dMass mass;
    const Vector3 inertia = body.inverse_inertia.cwiseInverse();
    dMassSetParameters(&mass, 1 / body.inverse_mass, 0, 0, 0, inertia.x(), inertia.y(), inertia.z(), 0, 0, 0);
    dBodySetMass(id, &mass);
    const Vector3& p = body.pose.position;
    const Quaternion& o = body.pose.orientation;
    const dQuaternion q = {o.w(), o.x(), o.y(), o.z()};
    dBodySetPosition(id, p.x(), p.y(), p.z());
    dBodySetQuaternion(id, q);
    dBodySetAutoDisableFlag(id, 0);
    bodies_.push_back(id);
  }
  void add(const Collider& collider) {
    if (const auto* polytope = std::get_if<Polytope>(&collider.shape)) {
      const Vector3 size = 2 * polytope->box.value().half_size;
      const dGeomID box = dCreateBox(space_, size.x(), size.y(), size.z());
      const Vector3& p = collider.placement.position;
      if (collider.body == world_body) {
        dGeomSetPosition(box, p.x(), p.y(), p.z());
      } else {
        dGeomSetBody(box, bodies_[collider.body]);
      }
    } else {
      dCreatePlane(space_, 0, 1, 0, 0);
    }
    friction_ = collider.material.dynamic_friction;
  }
  static void collide(void* data, dGeomID one, dGeomID other) {
    Ode& self = *static_cast<Ode*>(data);
    const dBodyID a = dGeomGetBody(one);
    const dBodyID b = dGeomGetBody(other);
    if (!a && !b) return;
    dContact found[most_contacts];
    const int count = dCollide(one, other, most_contacts, &found[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      found[i].surface.mode = dContactApprox1;  // Coulomb's limits, from the normal's impulse
      found[i].surface.mu = self.friction_;
      dJointAttach(dJointCreateContact(self.world_, self.contacts_, &found[i]), a, b);
    }
  }

  double step_;
  int iterations_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;
  double friction_ = 0;  ///< one for the whole scene
};

}  // namespace

std::unique_ptr<Contestant> make_ode(const Scene& scene, double step, int iterations) {
  return std::make_unique<Ode>(scene, step, iterations);
}

}  // namespace substep::benchmark
