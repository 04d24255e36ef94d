#pragma once
/// Parts that most scenes share: the light, the ground, and shorthands for joints.

#include <array>
#include <numbers>
#include <vector>

#include "gltf_builder.h"

namespace substep::scenes {

inline constexpr double pi = std::numbers::pi;

inline const Vector3 afternoon{-0.45, -1, -0.55};
inline constexpr std::array<double, 3> warm_white{1.0, 0.95, 0.86};
inline constexpr double daylight = 3;

inline constexpr auto linear = AxesLimit::Kind::linear;
inline constexpr auto angular = AxesLimit::Kind::angular;

inline AxesLimit locked(AxesLimit::Kind kind, const std::vector<int>& axes) {
  return {.kind = kind, .axes = axes, .min = 0, .max = 0};
}

/// Looks from a point towards a point, in the light of the afternoon; `field_of_view` is vertical, rad.
inline void set_view(GltfBuilder& gltf, const Vector3& from, const Vector3& towards, double field_of_view) {
  gltf.camera(from, towards, field_of_view);
  gltf.sun(afternoon, warm_white, daylight);
}

/// Collides as the plane y = 0.
inline void add_ground(GltfBuilder& gltf, double friction) {
  const int node = gltf.node("ground");
  const int shape = gltf.plane_shape();
  gltf.collider(node, shape, gltf.physics_material(friction));
}

/// A box that stands in the world, drawn with rounded edges.
inline int add_fixed_box(GltfBuilder& gltf, std::string_view name, const Vector3& size, const Pose& pose,
                         int physics_material, const Finish& finish, double rounding = 0.02) {
  const int node = gltf.node(name, pose);
  gltf.collider(node, gltf.box_shape(size), physics_material);
  const int look = gltf.geometry(rounded(box(size), rounding));
  gltf.show(node, gltf.mesh(name, {{look, gltf.material(finish)}}));
  return node;
}

/// A mesh in one finish that stands in the world and does not collide.
inline void add_scenery(GltfBuilder& gltf, std::string_view name, const Mesh& mesh, const Finish& finish) {
  const int geometry = gltf.geometry(mesh);
  gltf.show(gltf.node(name), gltf.mesh(name, {{geometry, gltf.material(finish)}}));
}

inline Vector3 box_inertia(double mass, const Vector3& size) {
  const Vector3 squares = size.cwiseProduct(size);
  return Vector3(squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y()) *
         (mass / 12);
}

}  // namespace substep::scenes
