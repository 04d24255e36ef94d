// Bullet's headers shadow names and convert freely.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {
namespace {

btVector3 vector(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}
btQuaternion quaternion(const Quaternion& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
btTransform transform(const Pose& pose) {
  return btTransform(quaternion(pose.orientation), vector(pose.position));
}
Vector3 vector(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}
Quaternion quaternion(const btQuaternion& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

/// A filter that rejects the pairs of EngineScene::apart. Each object's user index is its unit (unit_of()).
class PairFilter final : public btOverlapFilterCallback {
 public:
  explicit PairFilter(std::set<std::pair<int, int>> apart) : apart_(std::move(apart)) {}
  bool needBroadphaseCollision(btBroadphaseProxy* one, btBroadphaseProxy* other) const override {
    const bool by_group = (one->m_collisionFilterGroup & other->m_collisionFilterMask) != 0 &&
                          (other->m_collisionFilterGroup & one->m_collisionFilterMask) != 0;
    if (!by_group || apart_.empty()) return by_group;
    const auto unit = [](const btBroadphaseProxy* proxy) {
      return static_cast<const btCollisionObject*>(proxy->m_clientObject)->getUserIndex();
    };
    return !apart_.contains(std::minmax({unit(one), unit(other)}));
  }

 private:
  std::set<std::pair<int, int>> apart_;
};

class BulletStepper final : public Stepper {
 public:
  BulletStepper(const Scene& scene, const EngineScene& shared, const Settings& settings, bool direct)
      : step_(settings.step),
        dispatcher_(&configuration_),
        filter_(shared.apart),
        solver_(direct ? std::make_unique<btMLCPSolver>(&dantzig_)
                       : std::make_unique<btSequentialImpulseConstraintSolver>()),
        world_(&dispatcher_, &broad_phase_, solver_.get(), &configuration_),
        start_(initial_state(scene)),
        state_(start_) {
    broad_phase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
    world_.setGravity(vector(scene.gravity));
    world_.getSolverInfo().m_numIterations = settings.iterations;
    // Take the root, since Bullet multiplies the frictions of a pair.
    friction_ = std::sqrt(shared.friction);
    shapes_.resize(scene.bodies.size());
    bodies_.resize(scene.bodies.size());
    if (shared.has_contacts) {
      for (std::size_t i = 0; i < scene.colliders.size(); ++i) add(scene, static_cast<int>(i));
    }
    for (std::size_t i = 1; i < scene.bodies.size(); ++i) add(scene.bodies[i], scene.gyroscopic, i);
    for (const EngineJoint& joint : shared.joints) add(scene, joint);
  }
  ~BulletStepper() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& body : bodies_) {
      if (body) world_.removeRigidBody(body.get());
    }
    for (const auto& body : fixed_) world_.removeRigidBody(body.get());
  }
  BulletStepper(const BulletStepper&) = delete;
  BulletStepper& operator=(const BulletStepper&) = delete;

  bool step() override {
    // Place kinematic bodies: Bullet derives their velocities from their poses.
    const double time = ++steps_ * step_;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i] || !bodies_[i]->isKinematicObject()) continue;
      const auto& [q, v] = std::pair(start_.q[i], start_.v[i]);
      bodies_[i]->setWorldTransform(
          transform({q.linear + time * v.linear, compose(rotation_quaternion(time * v.angular), q.angular)}));
    }
    world_.stepSimulation(step_, 0);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i]) continue;
      const btTransform& at = bodies_[i]->getWorldTransform();
      next_.q[i] = {vector(at.getOrigin()), quaternion(at.getRotation())};
      next_.v[i] = {vector(bodies_[i]->getLinearVelocity()), vector(bodies_[i]->getAngularVelocity())};
    }
    if (!is_finite(next_)) return false;
    state_ = next_;
    return true;
  }
  const State& state() const override { return state_; }

 private:
  btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape) {
    parts_.push_back(std::move(shape));
    return parts_.back().get();
  }

  /// Adds a collider: a fixed body of the world, or a part of its body's compound shape.
  void add(const Scene& scene, int index) {
    const Collider& collider = scene.colliders[static_cast<std::size_t>(index)];
    const bool is_world = collider.body == world_body;
    const Pose& placement = collider.placement;
    btCollisionShape* shape = nullptr;
    if (const auto* polytope = std::get_if<Polytope>(&collider.shape); polytope && polytope->half_box) {
      shape = keep(std::make_unique<btBoxShape>(vector(*polytope->half_box)));
    } else if (polytope) {
      auto hull = std::make_unique<btConvexHullShape>();
      for (const Vector3& vertex : polytope->vertices) hull->addPoint(vector(vertex), false);
      hull->recalcLocalAabb();
      shape = keep(std::move(hull));
    } else if (const auto* sphere = std::get_if<Sphere>(&collider.shape)) {
      shape = keep(std::make_unique<btSphereShape>(sphere->radius));
    } else if (const auto* capsule = std::get_if<Capsule>(&collider.shape)) {
      shape = keep(std::make_unique<btCapsuleShape>(capsule->radius, 2 * capsule->half_length));
    } else if (std::holds_alternative<Plane>(collider.shape) && is_world) {
      shape = keep(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), 0));
    } else {
      throw Error("a collider is no box, hull, sphere, capsule or fixed plane");
    }
    if (!is_world) {
      auto& compound = shapes_[collider.body];
      if (!compound) compound = std::make_unique<btCompoundShape>();
      compound->addChildShape(transform(placement), shape);
      return;
    }
    fixed_.push_back(std::make_unique<btRigidBody>(0, nullptr, shape));
    fixed_.back()->setWorldTransform(transform(placement));
    fixed_.back()->setFriction(friction_);
    fixed_.back()->setUserIndex(unit_of(scene, index));
    world_.addRigidBody(fixed_.back().get());
  }

  void add(const Body& body, bool gyroscopic, std::size_t index) {
    const bool collides = shapes_[index] != nullptr;
    btCollisionShape* shape = shapes_[index].get();
    if (!collides) {
      shape = keep(std::make_unique<btSphereShape>(0.01));
    } else if (shapes_[index]->getNumChildShapes() == 1 &&
               transform(Pose{}) == shapes_[index]->getChildTransform(0)) {
      shape = shapes_[index]->getChildShape(0);  // a compound has fewer contacts than its only child
    }
    const bool is_moved = body.inverse_mass > 0;
    bodies_[index] = std::make_unique<btRigidBody>(
        is_moved ? 1 / body.inverse_mass : 0, nullptr, shape,
        is_moved ? vector(body.inverse_inertia.cwiseInverse()) : btVector3(0, 0, 0));
    btRigidBody& made = *bodies_[index];
    if (!is_moved) made.setCollisionFlags(made.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    made.setUserIndex(static_cast<int>(index));
    made.setWorldTransform(transform(body.pose));
    made.setInterpolationWorldTransform(transform(body.pose));
    made.setLinearVelocity(vector(body.linear_velocity));
    made.setAngularVelocity(vector(body.angular_velocity));
    made.setFriction(friction_);
    if (!gyroscopic && is_moved) made.setFlags(0);  // without a gyroscopic force
    made.setActivationState(DISABLE_DEACTIVATION);
    if (collides) {
      world_.addRigidBody(&made);
    } else {
      world_.addRigidBody(&made, 0, 0);  // in no group, meets no group
    }
  }

  void add(const Scene& scene, const EngineJoint& joint) {
    btRigidBody& a = *bodies_[joint.a];
    const bool on_world = joint.b == world_body;
    const btVector3 at_a = vector(joint.anchor_a);
    const btVector3 at_b = vector(joint.anchor_b);
    std::unique_ptr<btTypedConstraint> made;
    switch (joint.kind) {
      case EngineJoint::Kind::ball:
        made = on_world ? std::make_unique<btPoint2PointConstraint>(a, at_a)
                        : std::make_unique<btPoint2PointConstraint>(a, *bodies_[joint.b], at_a, at_b);
        break;
      case EngineJoint::Kind::hinge:
        made = on_world ? std::make_unique<btHingeConstraint>(a, at_a, vector(joint.axis_a))
                        : std::make_unique<btHingeConstraint>(a, *bodies_[joint.b], at_a, at_b,
                                                              vector(joint.axis_a), vector(joint.axis_b));
        break;
      case EngineJoint::Kind::fixed: {
        const Pose frame_a{joint.anchor_a, Quaternion::Identity()};
        const Pose in_b = scene.bodies[joint.b].pose.inverse() * (scene.bodies[joint.a].pose * frame_a);
        btRigidBody& b = on_world ? btTypedConstraint::getFixedBody() : *bodies_[joint.b];
        made = std::make_unique<btFixedConstraint>(a, b, transform(frame_a), transform(in_b));
        break;
      }
    }
    joints_.push_back(std::move(made));
    world_.addConstraint(joints_.back().get());
  }

  double step_;
  double friction_ = 0;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broad_phase_;
  PairFilter filter_;
  btDantzigSolver dantzig_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::vector<std::unique_ptr<btCollisionShape>> parts_;
  std::vector<std::unique_ptr<btCompoundShape>> shapes_;  ///< by body
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btRigidBody>> fixed_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  btDiscreteDynamicsWorld world_;
  State start_;
  int steps_ = 0;
  State state_;
  State next_ = state_;
};

}  // namespace

Stepper* make_engine_stepper(const Scene& scene, const EngineScene& shared, const Settings& settings,
                             const std::string& solver) {
  return std::make_unique<BulletStepper>(scene, shared, settings, solver == "Dantzig").release();
}

}  // namespace substep
