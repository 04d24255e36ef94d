#include "sim/model.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/error.h"

namespace substep {
namespace {

Vector3 moments(const Vector3& inverse_inertia) {
  Vector3 result = Vector3::Zero();
  for (int i = 0; i < 3; ++i) {
    if (inverse_inertia[i] > 0) result[i] = 1 / inverse_inertia[i];
  }
  return result;
}

bool locked(const JointLimit& limit) {
  return limit.min == 0 && limit.max == 0 && !limit.stiffness;
}

void add_joint(const Scene& scene, const Joint& joint, Model& model) {
  const auto refuse = [&](const std::string& what) {
    throw Error(fmt::format("{}: joint {}: {}", scene.file.string(), joint.name, what));
  };
  std::array<bool, 3> linear{};
  std::array<bool, 3> angular{};
  for (const JointLimit& limit : joint.limits) {
    if (!locked(limit)) refuse("only limits with min 0 and max 0 are modelled, without stiffness");
    for (int axis = 0; axis < 3; ++axis) {
      if (limit.axes[axis]) (limit.angular ? angular : linear)[axis] = true;
    }
  }
  if (!(linear[0] && linear[1] && linear[2])) {
    refuse("its three linear axes must be locked: ball joints and hinges are modelled");
  }
  model.points.push_back({joint.body_a, joint.body_b, joint.frame_a.position, joint.frame_b.position});

  const auto axis_of = [](const Pose& frame, int axis) -> Vector3 {
    return frame.orientation * Vector3::Unit(axis);
  };
  const int locked_axes = angular[0] + angular[1] + angular[2];
  if (locked_axes == 2) {
    const int free_axis = !angular[0] ? 0 : !angular[1] ? 1 : 2;
    model.axes.push_back({joint.body_a, joint.body_b, axis_of(joint.frame_a, free_axis),
                          axis_of(joint.frame_b, (free_axis + 1) % 3),
                          axis_of(joint.frame_b, (free_axis + 2) % 3)});
  } else if (locked_axes != 0) {
    refuse("no or two angular axes can be locked: ball joints and hinges are modelled");
  }
  for (const JointDrive& drive : joint.drives) {
    if (!drive.angular || drive.stiffness != 0) refuse("only angular drives towards a velocity are modelled");
    if (!(drive.damping > 0)) refuse("a drive needs damping > 0: it is what turns a velocity into a torque");
    model.drives.push_back({joint.body_a, joint.body_b, axis_of(joint.frame_b, drive.axis),
                            drive.velocity_target, drive.damping, drive.acceleration, drive.max_force});
  }
}

std::string counted(std::size_t count, const char* thing) {
  return fmt::format("{} {}{}", count, thing, count == 1 ? "" : "s");
}

}  // namespace

Model build_model(const Scene& scene) {
  Model model;
  model.gravity = scene.gravity;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    model.masses.push_back({body.inverse_mass, body.inverse_inertia, body.gravity_factor});
    const Vector3 inertia = moments(body.inverse_inertia);
    model.inertia.push_back(inertia);
    const bool finite = body.inverse_inertia.minCoeff() > 0;
    const bool equal = inertia[0] == inertia[1] && inertia[1] == inertia[2];
    if (scene.gyroscopic && finite && !equal) model.gyroscopic.push_back(static_cast<int>(i));
  }
  for (const Joint& joint : scene.joints) {
    add_joint(scene, joint, model);
    if (!joint.enable_collision) model.jointed.emplace_back(std::minmax(joint.body_a, joint.body_b));
  }
  std::ranges::sort(model.jointed);
  const auto movable = [&](const Collider& c) { return scene.bodies[c.body].inverse_mass > 0; };
  model.contacts = scene.colliders.size() > 1 && std::ranges::any_of(scene.colliders, movable);
  model.friction = model.contacts && std::ranges::any_of(scene.colliders, [](const Collider& c) {
                     return c.material.dynamic_friction > 0;
                   });
  return model;
}

std::string description(const Model& model) {
  std::string joints;
  const std::size_t hinges = model.axes.size();
  const std::size_t balls = model.points.size() - hinges;
  if (balls > 0) joints += counted(balls, "ball joint");
  if (hinges > 0) joints += (joints.empty() ? "" : ", ") + counted(hinges, "hinge");
  if (!model.drives.empty())
    joints += (joints.empty() ? "" : ", ") + counted(model.drives.size(), "velocity drive");
  return fmt::format("{}; {}; {}", joints.empty() ? "no joints" : joints,
                     !model.contacts  ? "no contacts"
                     : model.friction ? "contacts with friction"
                                      : "contacts without friction",
                     model.gyroscopic.empty()
                         ? std::string("no gyroscopic term")
                         : fmt::format("gyroscopic term of {} of {} bodies", model.gyroscopic.size(),
                                       model.masses.size() - 1));
}

}  // namespace substep
