#pragma once
/// A scene's bodies: their nodes, attachments, masses and frames.

#include "sim/loading/scene_draft.h"

namespace substep {

/// Adds the world and one body for each node with a motion; place_bodies() sets masses and poses.
void add_bodies(SceneDraft& draft);

/// Finds each node's body, and its pose in that body's node. The pose is composed from the body's node
/// downwards, not through the world, so that parts of that node are exactly at its origin.
void find_attachments(SceneDraft& draft);

/// Sets the bodies' masses, frames and velocities, and moves their colliders into those frames. Throws Error
/// where numbers that are fine one by one overflow together.
void place_bodies(SceneDraft& draft);

/// Warns of bodies at rest with "mass": 0 that no joint holds: they float.
void warn_of_floating_bodies(SceneDraft& draft);

/// Returns a pose in the frame of a body that place_bodies() has placed.
Pose in_body(const Body& body, const Pose& in_node);

}  // namespace substep
