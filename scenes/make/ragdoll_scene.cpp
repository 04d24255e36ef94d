/// An artist's mannequin that falls down a stair: joints with limits, and contacts.

#include <algorithm>

#include "finishes.h"
#include "gltf_builder.h"
#include "mesh.h"
#include "scenes.h"
#include "stage.h"

namespace substep::scenes {

std::string ragdoll() {
  constexpr int steps = 5;
  constexpr double rise = 0.2;
  constexpr double tread = 0.36;
  constexpr double top = rise * steps;

  GltfBuilder gltf("ragdoll", 4);
  gltf.substeps(32);  // ten are too few for its impacts: scenes/ragdoll.md
  gltf.poster(0.75);
  gltf.camera({2.7, 2.6, 6.0}, {0.30, 1.20, 0}, 0.56);
  gltf.sun({-0.3, -1, -0.7}, warm_white, daylight);
  add_ground(gltf, 0.6);
  const int grip = gltf.physics_material(0.6);
  for (int i = 0; i < steps; ++i) {
    // Each step is a box from the landing to the step's edge.
    const double right = -0.9 + tread * (steps - i);
    const double length = right + 2.1;
    add_fixed_box(gltf, "step_" + std::to_string(i + 1), {length, rise, 2.0},
                  at(right - length / 2, rise * (i + 0.5), 0), grip,
                  i % 2 == 0 ? finish::limestone : finish::sandstone);
  }

  // An artist's mannequin, facing +X, on its toes.
  const int wood = gltf.material(finish::maple);
  const int dark = gltf.material(finish::walnut);
  const int figure = gltf.node("figure", at(-1.15, top + 0.006, 0) * turn(Vector3::UnitZ(), -0.16));
  const auto moving = [&](int node, double mass) {
    gltf.motion(node,
                {.mass = mass, .linear_velocity = {1.6, 0.3, 0.15}, .angular_velocity = {0.1, 0.2, -0.8}});
  };
  const auto add_block = [&](const char* name, double y, const Vector3& size, double mass) {
    const int body = gltf.node(name, at(0, y, 0), figure);
    moving(body, mass);
    gltf.collider(body, gltf.box_shape(size), grip);
    const int look = gltf.geometry(rounded(box(size), 0.4 * std::min(size.x(), size.y()), 4));
    gltf.show(body, gltf.mesh(name, {{look, wood}}));
    return body;
  };
  // A limb hangs from its upper end; `length` is from joint to joint.
  const auto add_limb = [&](const std::string& name, const Vector3& upper_end, double length, double radius,
                            double mass) {
    const int body = gltf.node(name, at(upper_end.x(), upper_end.y() - length / 2, upper_end.z()), figure);
    moving(body, mass);
    const double straight = length - 2.6 * radius;
    gltf.collider(body, gltf.capsule_shape(radius, straight), grip);
    const std::array<ProfilePoint, 6> profile{{{0, -straight / 2 - radius},
                                               {0.8 * radius, -straight / 2 - radius, 0.6 * radius},
                                               {radius, -straight / 2 + 0.3 * radius, 0.3 * radius},
                                               {0.8 * radius, straight / 2, 0.3 * radius},
                                               {0.8 * radius, straight / 2 + radius, 0.6 * radius},
                                               {0, straight / 2 + radius}}};
    const int look = gltf.geometry(turned(profile, 28));
    const int knob = gltf.geometry(Mesh().add(ball(0.62 * radius, 20), at(0, length / 2, 0)));
    gltf.show(body, gltf.mesh(name, {{look, wood}, {knob, dark}}));
    return body;
  };
  const auto join = [&](const std::string& name, int child, const Vector3& at_child, int parent,
                        const Vector3& at_parent, int description) {
    const int held = gltf.node(name + "_socket", at(at_parent.x(), at_parent.y(), at_parent.z()), parent);
    gltf.joint(gltf.node(name, at(at_child.x(), at_child.y(), at_child.z()), child), held, description);
  };
  const AxesLimit point = locked(linear, {0, 1, 2});
  const auto cone = [](double angle) { return AxesLimit{.kind = angular, .axes = {0, 2}, .max = angle}; };
  const auto twist = [](double angle) {
    return AxesLimit{.kind = angular, .axes = {1}, .min = -angle, .max = angle};
  };

  const int pelvis = add_block("pelvis", 0.95, {0.16, 0.16, 0.30}, 12);
  const int chest = add_block("chest", 1.27, {0.19, 0.36, 0.36}, 22);
  const int head = gltf.node("head", at(0, 1.62, 0), figure);
  moving(head, 5);
  gltf.collider(head, gltf.sphere_shape(0.11), grip);
  const int skull = gltf.geometry(ball(0.11, 32));
  const int neck = gltf.geometry(Mesh()
                                     .add(rod(0.12, 0.035, 0.01), at(0, -0.12, 0))
                                     .add(ball(0.018, 16), at(0.105, 0.02, 0.04))
                                     .add(ball(0.018, 16), at(0.105, 0.02, -0.04)));
  gltf.show(head, gltf.mesh("head", {{skull, wood}, {neck, dark}}));

  // Limit the angle between pelvis and chest, about any axis.
  const int spine = gltf.joint_description({point, {.kind = angular, .axes = {0, 1, 2}, .max = 0.5}});
  join("spine", chest, {0, -0.21, 0}, pelvis, {0, 0.11, 0}, spine);
  const int nape = gltf.joint_description({point, cone(0.5), twist(0.8)});
  join("neck", head, {0, -0.16, 0}, chest, {0, 0.19, 0}, nape);
  const int shoulder = gltf.joint_description({point, cone(1.7), twist(0.8)});
  const int hip = gltf.joint_description({point, cone(1.0), twist(0.4)});
  // Angles are those of the upper limb as seen from the lower one.
  const int elbow = gltf.joint_description(
      {point, locked(angular, {0, 1}), {.kind = angular, .axes = {2}, .min = -2.4, .max = 0}});
  const int knee = gltf.joint_description(
      {point, locked(angular, {0, 1}), {.kind = angular, .axes = {2}, .min = 0, .max = 2.4}});
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    const int upper_arm = add_limb(name + "_upper_arm", {0, 1.40, side * 0.25}, 0.29, 0.048, 2);
    const int forearm = add_limb(name + "_forearm", {0, 1.11, side * 0.25}, 0.30, 0.040, 1.5);
    const int thigh = add_limb(name + "_thigh", {0, 0.86, side * 0.10}, 0.41, 0.070, 7);
    const int shin = add_limb(name + "_shin", {0, 0.45, side * 0.10}, 0.46, 0.052, 4);
    join(name + "_shoulder", upper_arm, {0, 0.145, 0}, chest, {0, 0.13, side * 0.25}, shoulder);
    join(name + "_elbow", forearm, {0, 0.15, 0}, upper_arm, {0, -0.145, 0}, elbow);
    join(name + "_hip", thigh, {0, 0.205, 0}, pelvis, {0, -0.09, side * 0.10}, hip);
    join(name + "_knee", shin, {0, 0.23, 0}, thigh, {0, -0.205, 0}, knee);
  }

  gltf.expect_no_gain(5, "nothing drives it, and no contact gives energy");
  return gltf.text();
}

}  // namespace substep::scenes
