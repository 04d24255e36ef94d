#pragma once
/// Trees of bodies for engines in reduced coordinates.

#include <vector>

#include "sim/scene/scene.h"
#include "sim/study/engines/engine_scene.h"

namespace substep {

struct EngineLink {
  int body;
  int parent;                ///< the world, or a body of an earlier link
  const EngineJoint* joint;  ///< null: it is free, and its parent is the world
  bool is_a;                 ///< whether `body` is the joint's a
};

/// Returns the links, parents before children. Joints that close a loop go to `closing`; without it they
/// throw Error.
std::vector<EngineLink> tree_of(const Scene& scene, const std::vector<EngineJoint>& joints,
                                std::vector<const EngineJoint*>* closing = nullptr);

/// The joint's anchor and axis in the frames of the link's body and of its parent.
Vector3 anchor_of_body(const EngineLink& link);
Vector3 anchor_of_parent(const EngineLink& link);
Vector3 axis_of_body(const EngineLink& link);

/// Returns the angular velocity of the link's body relative to its parent at the start, in the body's frame.
Vector3 relative_spin(const Scene& scene, const EngineLink& link);

}  // namespace substep
