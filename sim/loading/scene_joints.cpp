#include "sim/loading/scene_joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/loading/scene_bodies.h"

namespace substep {
namespace {

/// Returns the world's colliders at a node of the world, above it and below it: the object that a joint to
/// this node connects. A collider without motion is an object of its own in the extension, unlike a body's.
std::vector<int> static_colliders_of(const SceneDraft& draft, int node) {
  std::vector<int> result;
  const auto add = [&](int at) {
    const int collider = draft.collider_of_node[at];
    if (collider >= 0 && draft.attachments[at].body == world_body) result.push_back(collider);
  };
  for (int at = draft.document.nodes[node].parent; at >= 0; at = draft.document.nodes[at].parent) add(at);
  std::vector<int> pending{node};
  while (!pending.empty()) {
    const int at = pending.back();
    pending.pop_back();
    add(at);
    const std::vector<int>& children = draft.document.nodes[at].children;
    pending.insert(pending.end(), children.begin(), children.end());
  }
  std::ranges::sort(result);
  return result;
}

void add_joint(SceneDraft& draft, int node, const JointProperties& properties) {
  const JsonValue place = draft.extension(node, "joint");
  const int connected = properties.connected_node;
  if (!draft.document.nodes[connected].in_scene) {
    place.require("connectedNode")
        .fail(fmt::format("the joint leads to node {} ('{}'), which is not in the scene", connected,
                          draft.document.nodes[connected].name));
  }
  Joint joint;
  joint.name = draft.document.nodes[node].name;
  joint.enable_collision = properties.enable_collision;
  const auto frame = [&](int end, int& body) {
    const NodeAttachment& attached = draft.attachments[end];
    if (attached.in_node.sheared && !attached.in_node.turned) {
      place.fail(fmt::format("node {} ('{}') is sheared or flat, so the joint has no frame there", end,
                             draft.document.nodes[end].name));
    }
    if (attached.in_node.sheared) {
      draft.scene.warnings.push_back(
          fmt::format("{}: node {} ('{}') is turned inside an unequal scale; the joint's frame is turned "
                      "without the scale",
                      place.path(), end, draft.document.nodes[end].name));
    }
    body = attached.body;
    return in_body(draft.scene.bodies[body], attached.in_node.rigid());
  };
  joint.frame_a = frame(node, joint.body_a);
  joint.frame_b = frame(connected, joint.body_b);
  if (joint.body_a == joint.body_b) {
    place.fail(joint.body_a == world_body
                   ? "joins two nodes of which neither belongs to a body: give one of them a 'motion'"
                   : fmt::format("joins the body '{}' to itself", draft.scene.bodies[joint.body_a].name));
  }
  if (joint.body_a == world_body) joint.silent_colliders = static_colliders_of(draft, node);
  if (joint.body_b == world_body) joint.silent_colliders = static_colliders_of(draft, connected);
  const JointDescription& description = draft.tables.joints[properties.description];
  joint.limits = description.limits;
  joint.drives = description.drives;
  draft.scene.joints.push_back(std::move(joint));
}

}  // namespace

void add_joints(SceneDraft& draft) {
  for (std::size_t i = 0; i < draft.physics.size(); ++i) {
    if (draft.physics[i].joint) add_joint(draft, static_cast<int>(i), *draft.physics[i].joint);
  }
}

}  // namespace substep
