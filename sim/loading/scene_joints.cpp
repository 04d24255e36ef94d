#include "sim/loading/scene_joints.h"

#include <fmt/format.h>

#include <utility>

#include "sim/loading/scene_bodies.h"

namespace substep {
namespace {

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
