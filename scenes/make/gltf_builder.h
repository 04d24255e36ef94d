#pragma once
/// Builds one glTF 2.0 document with KHR_physics_rigid_bodies, KHR_implicit_shapes and KHR_lights_punctual.
///
/// Everything is referred to by index, as in the file. One base64 buffer holds positions and normals as
/// 32-bit floats and indices as 16-bit integers; other numbers are JSON and read back to the same double.
///
/// The file must be the same whatever compiler made it. C++ leaves the order of a call's arguments open, so
/// no two arguments of one call may append to the same list.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "mesh.h"
#include "sim/math/vector.h"

namespace substep::scenes {

using Json = nlohmann::ordered_json;

/// A material of glTF.
struct Finish {
  std::string_view name;
  std::array<double, 3> color;  ///< linear RGB
  double metallic = 0;
  double roughness = 0.5;
  bool double_sided = false;  ///< faces are drawn on both sides, and open meshes collide on both
};

struct Motion {
  double mass = 1;                      ///< kg
  std::optional<Vector3> inertia = {};  ///< principal moments, kg·m²; else the colliders'
  Quaternion inertia_orientation = Quaternion::Identity();  ///< of the principal axes in the node
  std::optional<Vector3> centre_of_mass = {};               ///< node space; else the colliders'
  Vector3 linear_velocity = Vector3::Zero();                ///< node space, m/s
  Vector3 angular_velocity = Vector3::Zero();               ///< node space, rad/s
  bool kinematic = false;                                   ///< keeps its velocity in all impacts
};

/// A bound on one, two or three axes of a joint, as in the extension. Without stiffness the bound is hard.
struct AxesLimit {
  enum class Kind { linear, angular } kind;
  std::vector<int> axes;
  std::optional<double> min = {};  ///< m or rad
  std::optional<double> max = {};
  std::optional<double> stiffness = {};  ///< N/m or N·m/rad
  double damping = 0;                    ///< N·s/m or N·m·s/rad
};

inline AxesLimit locked(AxesLimit::Kind kind, const std::vector<int>& axes) {
  return {.kind = kind, .axes = axes, .min = 0, .max = 0};
}

/// A drive along or about one axis of a joint. With `acceleration` the last three are per kg or kg·m².
struct AxisDrive {
  AxesLimit::Kind kind;
  int axis;
  bool acceleration = false;
  double position = 0;   ///< target, m or rad
  double velocity = 0;   ///< target, m/s or rad/s
  double stiffness = 0;  ///< N/m or N·m/rad
  double damping = 0;    ///< N·s/m or N·m·s/rad
  double max_force = 0;  ///< N or N·m
};

/// Duration of a run and its settings: `extras.substep` of the scene.
struct Run {
  double duration;                    ///< s
  std::optional<double> poster = {};  ///< s, time of the scene's picture
  Vector3 gravity = {0, -9.81, 0};    ///< m/s²
  double step = 1.0 / 60;             ///< s
  std::optional<int> substeps = {};   ///< default: by the bodies' masses
};

inline const Vector3 afternoon{-0.45, -1, -0.55};

/// Camera, sun and ground, which are the first nodes of a scene.
struct Stage {
  Vector3 eye;
  Vector3 target;
  double yfov;                          ///< vertical, rad; 16:9, +Y up
  std::optional<double> friction = {};  ///< of the ground, the plane y = 0; without it there is no ground
  Vector3 light = afternoon;            ///< direction in which the sun shines
};

/// A known quantity of the scene's motion, with the keys of `extras.substep.expected` in scenes/format.md. An
/// empty name is derived from the other keys.
struct Quantity {
  std::string name;
  std::string_view quantity;
  std::vector<std::string> bodies = {};
  std::optional<Vector3> direction = {};
  std::string_view relative_to = {};
  bool in_node = false;  ///< the direction is in the body's node
};

/// The value of a quantity that is compared: the worst, that at a time, a mean, that of a peak, …
inline const Json any_time = Json::object();
inline Json at_time(double seconds) {
  return {{"at", seconds}};
}
inline Json mean(double begin, double end) {
  return {{"mean", {begin, end}}};
}
inline Json throughout(double begin, double end) {
  return {{"throughout", {begin, end}}};
}
inline Json peak(int number) {
  return {{"peak", number}};
}
inline Json crossing(int number) {
  return {{"crossing", number}};
}
inline Json crossing(int number, double level) {
  return {{"crossing", number}, {"level", level}};
}
inline Json stays(double level) {
  return {{"stays", level}};
}

/// A value, or a bound of it.
struct Bound {
  Bound(double number, const char* name = "value") : value(number), key(name) {}
  double value;
  const char* key;
};

inline Bound at_most(double value) {
  return {value, "at_most"};
}
inline Bound at_least(double value) {
  return {value, "at_least"};
}

/// A primitive of a mesh: a geometry, new or by its index, in one finish.
struct Primitive {
  std::variant<int, Mesh> geometry;
  Finish finish;
};

/// The mesh that a node shows: the index of a mesh, or the primitives of a new one.
struct NodeMesh {
  NodeMesh(int index) : mesh(index) {}
  NodeMesh(std::initializer_list<Primitive> list) : primitives(list) {}
  NodeMesh(const std::vector<Primitive>& list) : primitives(list) {}
  int mesh = -1;
  std::vector<Primitive> primitives;
};

/// A shape, or the mesh of a node (as its convex hull or as it is), of one physics material.
struct Collider {
  enum class Kind { shape, hull, mesh };
  int geometry;
  int material;
  Kind kind = Kind::shape;
};

class GltfBuilder {
 public:
  GltfBuilder(std::string_view name, const Run& run, const Stage& stage);

  const std::string& name() const { return name_; }

  /// Adds a known quantity, with the source of the value.
  void expect(const Quantity& quantity, const Json& when, const Bound& bound, double tolerance,
              std::string_view source);
  /// Expects that no centre of these bodies, or of any, is ever further from its start than `tolerance`.
  void expect_standing(double tolerance, std::string_view source,
                       const std::vector<std::string>& bodies = {});
  /// Expects the energy to differ from the start's by at most `tolerance`, J: without drives and losses.
  void expect_constant_energy(double tolerance, std::string_view source);
  /// Expects the energy never to exceed the start's by more than `tolerance`, J.
  void expect_no_gain(double tolerance, std::string_view source);

  /// Returns the material of a finish: one for each name, in the order of the first calls.
  int material(const Finish& finish);

  /// Adds vertices and triangles that several meshes may show in different materials. Without normals they
  /// are drawn with flat faces.
  int geometry(const Mesh& mesh);
  int mesh(std::string_view name, const std::vector<Primitive>& primitives);

  /// Adds a node to the scene's tree; at the root without a parent.
  int node(std::string_view name, const Pose& pose = {}, std::optional<int> parent = {});
  /// Adds a node outside the scene, for colliders to refer to; never drawn.
  int detached_node(const std::string& name, const NodeMesh& look);
  /// Shows a mesh, which is named after the node where it is new.
  void show(int node, const NodeMesh& look);
  /// Stretches what the node holds along its axes.
  void scale(int node, const Vector3& factors);

  /// Adds a node with motion, collider and mesh.
  int body(std::string_view name, const Pose& pose, const Motion& motion, const Collider& collider,
           const NodeMesh& look, std::optional<int> parent = {});
  int body(std::string_view name, const Pose& pose, const Motion& motion, const NodeMesh& look,
           std::optional<int> parent = {});
  int fixed_body(std::string_view name, const Pose& pose, const Collider& collider, const NodeMesh& look,
                 std::optional<int> parent = {});
  /// Adds a box that does not move, drawn with rounded edges.
  int fixed_box(std::string_view name, const Vector3& size, const Pose& pose, int physics_material,
                const Finish& finish, double rounding = 0.02);
  /// Adds a node that is drawn and does not collide.
  int scenery(std::string_view name, const NodeMesh& look, const Pose& pose = {},
              std::optional<int> parent = {});
  /// Adds the plane y = 0.
  void ground(int physics_material);

  int box_shape(const Vector3& size);
  int sphere_shape(double radius);
  /// Adds a capsule along Y; `height` is of the straight part.
  int capsule_shape(double radius_bottom, double radius_top, double height);
  /// Adds a cylinder along Y; a cone with a radius of 0.
  int cylinder_shape(double radius_bottom, double radius_top, double height);
  /// Adds a material without restitution; the smaller friction of two materials counts.
  int physics_material(double static_friction, std::optional<double> dynamic_friction = {});
  /// Adds a material; the larger restitution of two materials counts, and the smaller friction.
  int bouncing_material(double restitution, double friction = 0);

  void motion(int node, const Motion& motion);
  void collider(int node, const Collider& collider);
  /// Puts a node's collider into a collision system. It collides with `only_with` alone, or with all.
  void collide_as(int node, std::string_view system, std::optional<std::string_view> only_with = {});

  /// Return the description of a ball joint, which keeps two points together, or a hinge about the node's +Z.
  int ball_joint() { return joint_description({locked(AxesLimit::Kind::linear, {0, 1, 2})}); }
  int hinge(const std::vector<AxisDrive>& drives = {});
  int joint_description(const std::vector<AxesLimit>& limits, const std::vector<AxisDrive>& drives = {});
  /// Joins two nodes. Limits and drives act on the coordinates of `connected_node` in the frame of `node`.
  /// `collide`: whether the two bodies collide.
  void joint(int node, int connected_node, int joint_description, bool collide = false);
  /// Joins the −X end of a link of a chain to the node where the chain ends. Returns the node of its +X end.
  int add_link(int number, int body, double length, int end, int joint_description);

  /// Returns the file: a line for each key, and for each element of a top-level list of objects.
  std::string text() const;

 private:
  int shape(const char* type, const Json& json);
  int surface(double static_friction, double dynamic_friction, double restitution, const char* combine);
  Json& settings() { return document_["scenes"][0]["extras"]["substep"]; }
  Json& extension(int node, const char* name) { return document_["nodes"][node]["extensions"][name]; }
  int accessor(std::string_view bytes, int target, int component_type, const char* type, std::size_t count);

  std::string name_;
  Json document_;
  std::string buffer_;
};

}  // namespace substep::scenes
