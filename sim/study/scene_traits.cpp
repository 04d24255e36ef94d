#include "sim/study/scene_traits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <variant>
#include <vector>

#include "sim/error.h"
#include "sim/loading/needed_substeps.h"
#include "sim/measure/metrics.h"
#include "sim/model/model.h"

namespace substep {
namespace {

constexpr std::array<std::string_view, 4> contact_kinds{"none", "standing", "rolling", "moving"};

bool is_fixed(const Scene& scene, int body) {
  return scene.bodies[static_cast<std::size_t>(body)].inverse_mass == 0;
}

bool has_loops(const Scene& scene) {
  std::vector<int> root(scene.bodies.size());
  std::iota(root.begin(), root.end(), 0);
  const auto root_of = [&](int body) {
    if (is_fixed(scene, body)) return world_body;
    while (root[static_cast<std::size_t>(body)] != body) body = root[static_cast<std::size_t>(body)];
    return body;
  };
  return std::ranges::any_of(scene.joints, [&](const Joint& joint) {
    const int a = root_of(joint.body_a);
    const int b = root_of(joint.body_b);
    root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    return a == b;
  });
}

bool rolls(const Scene& scene) {
  return std::ranges::any_of(scene.colliders, [&](const Collider& collider) {
    const bool is_round = !std::holds_alternative<Plane>(collider.shape) &&
                          !std::holds_alternative<Polytope>(collider.shape) &&
                          !std::holds_alternative<TriangleMesh>(collider.shape);
    return is_round && !is_fixed(scene, collider.body);
  });
}

/// 1/kg, or 1/(kg m²), of what a spring between the two bodies moves.
double mobility(const Scene& scene, const Joint& joint, bool angular) {
  double sum = 0;
  for (const int i : {joint.body_a, joint.body_b}) {
    const Body& body = scene.bodies[static_cast<std::size_t>(i)];
    sum += angular ? body.inverse_inertia.maxCoeff() : body.inverse_mass;
  }
  return sum;
}

double spring_angle(const Scene& scene) {
  double most = 0;
  for (const Joint& joint : scene.joints) {
    for (const JointLimit& limit : joint.limits)
      most = std::max(most, limit.stiffness.value_or(0) * mobility(scene, joint, limit.angular));
    for (const JointDrive& drive : joint.drives) {
      const double per_unit = drive.acceleration ? 1 : mobility(scene, joint, drive.angular);
      most = std::max(most, drive.stiffness * per_unit);
    }
  }
  return scene.step * std::sqrt(most);
}

}  // namespace

std::string_view name(ContactKind kind) {
  return contact_kinds.at(static_cast<std::size_t>(kind));
}

ContactKind contact_kind_named(std::string_view text) {
  const auto found = std::ranges::find(contact_kinds, text);
  if (found == contact_kinds.end()) throw Error(fmt::format("'{}' is no kind of contacts", text));
  return static_cast<ContactKind>(found - contact_kinds.begin());
}

SceneTraits traits_of(const Scene& scene, const ReferenceMotion& reference) {
  SceneTraits traits;
  traits.has_joints = !scene.joints.empty();
  traits.has_loops = has_loops(scene);
  traits.mass_ratio = mass_ratio(scene);
  traits.spring_angle = spring_angle(scene);
  if (build_model(scene).contacts) {
    traits.contacts = stands(scene, reference) ? ContactKind::standing
                      : rolls(scene)           ? ContactKind::rolling
                                               : ContactKind::moving;
  }
  return traits;
}

}  // namespace substep
