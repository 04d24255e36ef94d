#pragma once
/// Scenes made of shapes alone.

#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep::render {

/// The world, with a floor at y = 0 if wanted.
Scene empty_scene(bool with_floor = true);

/// Adds a body of one shape; returns its index.
int add_body(Scene& scene, const Shape& shape, const Vector3& position,
             const Quaternion& orientation = Quaternion::Identity());

/// A box on the floor, a ball beside it and a capsule in the air, with camera and sun.
Scene three_shapes();

}  // namespace substep::render
