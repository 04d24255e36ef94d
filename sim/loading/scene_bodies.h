#pragma once
/// A scene's bodies: which nodes carry them, what belongs to each, their masses and frames.

#include "sim/loading/scene_draft.h"

namespace substep {

/// The world and one body for each node with a motion; masses and poses come with place_bodies.
void add_bodies(SceneDraft& draft);

/// Composed from the body's node downwards, not through the world, so that what is on the body's own node is
/// exactly at its origin wherever the body stands.
void find_attachments(SceneDraft& draft);

/// Sets the bodies' masses, frames and velocities, and moves their colliders into those frames. Throws Error
/// where numbers that are fine one by one overflow together.
void place_bodies(SceneDraft& draft);

/// Warns of bodies at rest with "mass": 0 that no joint holds: they float.
void warn_of_floating_bodies(SceneDraft& draft);

/// In the frame of a body that place_bodies has placed.
Pose in_body(const Body& body, const Pose& in_node);

}  // namespace substep
