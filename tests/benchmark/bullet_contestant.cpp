// Bullet's headers shadow names and convert freely.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#include <cmath>

#include "tests/benchmark/contestant.h"

namespace substep::benchmark {
namespace {

btVector3 vector(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

class Bullet final : public Contestant {
 public:
  Bullet(const Scene& scene, double step, int iterations)
      : step_(step),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broad_phase_, &solver_, &configuration_) {
    world_.setGravity(vector(scene.gravity));
    world_.getSolverInfo().m_numIterations = iterations;
    shapes_.resize(scene.bodies.size());
    bodies_.resize(scene.bodies.size());
    for (const Collider& collider : scene.colliders) add(collider);
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) add(scene.bodies[i], i);
    for (const Joint& joint : scene.joints) add(joint);
  }
  ~Bullet() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& body : bodies_) {
      if (body) world_.removeRigidBody(body.get());
    }
    for (const auto& body : fixed_) world_.removeRigidBody(body.get());
  }
  Bullet(const Bullet&) = delete;
  Bullet& operator=(const Bullet&) = delete;

  void step() override { world_.stepSimulation(step_, 0); }
  Vector3 position(int body) const override {
    const btVector3& p = bodies_[body]->getWorldTransform().getOrigin();
    return {p.x(), p.y(), p.z()};
  }

 private:
  void add(const Collider& collider) {
    std::unique_ptr<btCollisionShape> shape;
    if (const auto* polytope = std::get_if<Polytope>(&collider.shape)) {
      shape = std::make_unique<btBoxShape>(vector(polytope->box.value().half_size));
    } else {
      shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), 0);
    }
    friction_ = std::sqrt(collider.material.dynamic_friction);  // a pair has the product
    if (collider.body != world_body) {
      shapes_[collider.body] = std::move(shape);
      return;
    }
    fixed_.push_back(std::make_unique<btRigidBody>(0, nullptr, shape.get()));
    fixed_.back()->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), vector(collider.placement.position)));
    fixed_.back()->setFriction(friction_);
    world_.addRigidBody(fixed_.back().get());
    fixed_shapes_.push_back(std::move(shape));
  }
  void add(const Body& body, std::size_t index) {
    const bool collides = shapes_[index] != nullptr;
    if (!collides) shapes_[index] = std::make_unique<btSphereShape>(0.01);
    bodies_[index] = std::make_unique<btRigidBody>(1 / body.inverse_mass, nullptr, shapes_[index].get(),
                                                   vector(body.inverse_inertia.cwiseInverse()));
    btRigidBody& made = *bodies_[index];
    const Quaternion& o = body.pose.orientation;
    made.setWorldTransform(btTransform(btQuaternion(o.x(), o.y(), o.z(), o.w()), vector(body.pose.position)));
    made.setFriction(friction_);
    made.setActivationState(DISABLE_DEACTIVATION);
    if (collides) {
      world_.addRigidBody(&made);
    } else {
      world_.addRigidBody(&made, 0, 0);  // in no group, meets none
    }
  }
  void add(const Joint& joint) {
    const btVector3 on_a = vector(joint.frame_a.position);
    if (joint.body_b == world_body) {
      joints_.push_back(std::make_unique<btPoint2PointConstraint>(*bodies_[joint.body_a], on_a));
    } else {
      joints_.push_back(std::make_unique<btPoint2PointConstraint>(
          *bodies_[joint.body_a], *bodies_[joint.body_b], on_a, vector(joint.frame_b.position)));
    }
    world_.addConstraint(joints_.back().get());
  }

  double step_;
  double friction_ = 0;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btCollisionShape>> fixed_shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btRigidBody>> fixed_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  btDiscreteDynamicsWorld world_;
};

}  // namespace

std::unique_ptr<Contestant> make_bullet(const Scene& scene, double step, int iterations) {
  return std::make_unique<Bullet>(scene, step, iterations);
}

}  // namespace substep::benchmark
