#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wextra"
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BallJoint.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#pragma GCC diagnostic pop

#include <fmt/format.h>

#include "sim/error.h"
#include "sim/study/engines/engine_links.h"
#include "sim/study/engines/engine_steppers.h"

namespace substep {
namespace {

namespace dynamics = dart::dynamics;

constexpr double fastest = 1e4;  ///< m/s and rad/s

Eigen::Isometry3d isometry(const Pose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = pose.orientation.toRotationMatrix();
  result.translation() = pose.position;
  return result;
}

class DartStepper final : public Stepper {
 public:
  DartStepper(const Scene& scene, const EngineScene& shared, const Settings& settings)
      : state_(initial_state(scene)) {
    if (!scene.gyroscopic) throw Error("its gyroscopic term cannot be left out");
    world_ = dart::simulation::World::create();
    world_->setTimeStep(settings.step);
    world_->setGravity(scene.gravity);
    world_->getConstraintSolver()->setCollisionDetector(dart::collision::DARTCollisionDetector::create());
    nodes_.resize(scene.bodies.size(), nullptr);
    const std::vector<EngineLink> links = tree_of(scene, shared.joints);
    for (const EngineLink& link : links) add(scene, link);
    if (shared.has_contacts) add_colliders(scene, shared.friction);
    for (const dynamics::SkeletonPtr& one : skeletons_) world_->addSkeleton(one);
  }

  bool step() override {
    // It ends the program when a number is not finite; what is as fast as this will soon not be.
    for (const dynamics::SkeletonPtr& one : skeletons_) {
      if (!(one->getVelocities().cwiseAbs().sum() < fastest)) return false;
    }
    world_->step();
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!nodes_[i]) continue;
      const Eigen::Isometry3d& at = nodes_[i]->getWorldTransform();
      next_.q[i] = {at.translation(), Quaternion(Matrix3(at.linear()))};
      next_.v[i] = {nodes_[i]->getLinearVelocity(), nodes_[i]->getAngularVelocity()};
    }
    if (!is_finite(next_)) return false;
    state_ = next_;
    return true;
  }
  const State& state() const override { return state_; }

 private:
  void add(const Scene& scene, const EngineLink& link) {
    const Body& body = scene.bodies[link.body];
    dynamics::BodyNode* const parent = nodes_[link.parent];
    const std::string name = fmt::format("{}", link.body);  // it complains of equal names
    const dynamics::SkeletonPtr skeleton = parent ? parent->getSkeleton() : dynamics::Skeleton::create(name);
    if (!parent) skeletons_.push_back(skeleton);
    // The joint's frame stands at the anchor, with the body's axes at the start.
    const Pose at_parent = scene.bodies[link.parent].pose.inverse() * body.pose;
    Pose in_body;
    if (link.joint) in_body.position = anchor_of_body(link);
    const Pose in_parent = at_parent * in_body;
    const auto make = [&](auto properties, auto* joint_type) {
      using Joint = std::remove_pointer_t<decltype(joint_type)>;
      properties.mT_ParentBodyToJoint = isometry(in_parent);
      properties.mT_ChildBodyToJoint = isometry(in_body);
      properties.mName = name;
      return skeleton
          ->createJointAndBodyNodePair<Joint>(parent, properties, dynamics::BodyNode::AspectProperties(name))
          .second;
    };
    dynamics::BodyNode* node = nullptr;
    const Vector3 spin = relative_spin(scene, link);
    if (!link.joint) {
      node = make(dynamics::FreeJoint::Properties(), static_cast<dynamics::FreeJoint*>(nullptr));
      Eigen::Matrix<double, 6, 1> velocity;
      velocity << spin, body.pose.orientation.conjugate() * body.linear_velocity;
      node->getParentJoint()->setVelocities(velocity);
    } else if (link.joint->kind == EngineJoint::Kind::ball) {
      node = make(dynamics::BallJoint::Properties(), static_cast<dynamics::BallJoint*>(nullptr));
      node->getParentJoint()->setVelocities(spin);
    } else if (link.joint->kind == EngineJoint::Kind::hinge) {
      dynamics::RevoluteJoint::Properties properties;
      properties.mAxis = axis_of_body(link);
      node = make(properties, static_cast<dynamics::RevoluteJoint*>(nullptr));
      node->getParentJoint()->setVelocity(0, spin.dot(axis_of_body(link)));
    } else {
      node = make(dynamics::WeldJoint::Properties(), static_cast<dynamics::WeldJoint*>(nullptr));
    }
    dynamics::Inertia inertia;
    inertia.setMass(1 / body.inverse_mass);
    const Vector3 moments = body.inverse_inertia.cwiseInverse();
    inertia.setMoment(moments.x(), moments.y(), moments.z(), 0, 0, 0);
    node->setInertia(inertia);
    nodes_[link.body] = node;
  }

  void add_colliders(const Scene& scene, double friction) {
    dynamics::BodyNode* ground = nullptr;
    for (const Collider& collider : scene.colliders) {
      dynamics::BodyNode* node = nodes_[collider.body];
      Pose placement = collider.placement;
      if (!node) {
        if (!ground) {
          skeletons_.push_back(dynamics::Skeleton::create("ground"));
          ground = skeletons_.back()->createJointAndBodyNodePair<dynamics::WeldJoint>().second;
        }
        node = ground;
        placement = scene.bodies[collider.body].pose * placement;
      }
      dynamics::ShapePtr shape;
      if (const auto* polytope = std::get_if<Polytope>(&collider.shape); polytope && polytope->box) {
        shape = std::make_shared<dynamics::BoxShape>(2 * polytope->box->half_size);
        placement = placement * polytope->box->pose;
      } else if (const auto* sphere = std::get_if<Sphere>(&collider.shape)) {
        shape = std::make_shared<dynamics::SphereShape>(sphere->radius);
      } else if (std::holds_alternative<Plane>(collider.shape)) {
        // Its own detector has no plane: a block whose top it is.
        constexpr double side = 100;
        shape = std::make_shared<dynamics::BoxShape>(Vector3::Constant(side));
        placement = placement * Pose{{0, -side / 2, 0}, Quaternion::Identity()};
      } else {
        throw Error("a collider is no box, sphere or plane");
      }
      auto* const made =
          node->createShapeNodeWith<dynamics::CollisionAspect, dynamics::DynamicsAspect>(shape);
      made->setRelativeTransform(isometry(placement));
      made->getDynamicsAspect()->setFrictionCoeff(friction);
    }
  }

  dart::simulation::WorldPtr world_;
  std::vector<dynamics::SkeletonPtr> skeletons_;
  std::vector<dynamics::BodyNode*> nodes_;  ///< by body
  State state_;
  State next_ = state_;
};

}  // namespace

Stepper* dart_stepper(const Scene& scene, const EngineScene& shared, const Settings& settings) {
  return std::make_unique<DartStepper>(scene, shared, settings).release();
}

}  // namespace substep
