#include "sim/study/engines/engine_links.h"

#include <deque>

#include "sim/error.h"

namespace substep {

std::vector<EngineLink> tree_of(const Scene& scene, const std::vector<EngineJoint>& joints,
                                std::vector<const EngineJoint*>* closing) {
  std::vector<EngineLink> links;
  std::vector<bool> placed(scene.bodies.size(), false);
  std::vector<bool> used(joints.size(), false);
  std::deque<int> reached{world_body};
  placed[world_body] = true;
  const auto follow = [&] {
    while (!reached.empty()) {
      const int parent = reached.front();
      reached.pop_front();
      for (std::size_t i = 0; i < joints.size(); ++i) {
        if (used[i] || (joints[i].a != parent && joints[i].b != parent)) continue;
        used[i] = true;
        const bool is_a = joints[i].b == parent;
        const int child = is_a ? joints[i].a : joints[i].b;
        if (placed[child]) {
          if (closing == nullptr) throw Error("its joints close a loop, which reduced coordinates have not");
          closing->push_back(&joints[i]);
          continue;
        }
        placed[child] = true;
        links.push_back({child, parent, &joints[i], is_a});
        reached.push_back(child);
      }
    }
  };
  follow();
  for (int body = 1; body < std::ssize(scene.bodies); ++body) {
    if (placed[body] || scene.bodies[body].inverse_mass == 0) continue;
    placed[body] = true;
    links.push_back({body, world_body, nullptr, true});
    reached.push_back(body);
    follow();
  }
  return links;
}

Vector3 anchor_of_body(const EngineLink& link) {
  return link.is_a ? link.joint->anchor_a : link.joint->anchor_b;
}
Vector3 anchor_of_parent(const EngineLink& link) {
  return link.is_a ? link.joint->anchor_b : link.joint->anchor_a;
}
Vector3 axis_of_body(const EngineLink& link) {
  return link.is_a ? link.joint->axis_a : link.joint->axis_b;
}

Vector3 relative_spin(const Scene& scene, const EngineLink& link) {
  const Body& body = scene.bodies[link.body];
  const Vector3 relative = body.angular_velocity - scene.bodies[link.parent].angular_velocity;
  return body.pose.orientation.conjugate() * relative;
}

}  // namespace substep
