#pragma once
/// Builds one glTF 2.0 document with KHR_physics_rigid_bodies, KHR_implicit_shapes and KHR_lights_punctual.
///
/// Everything is referred to by index, as in the file. Positions and normals are stored as 32-bit floats in
/// one buffer, embedded in base64; all else is JSON numbers that read back to the same double.
///
/// The file must be the same whatever compiler made it. C++ leaves the order of a call's arguments open, so
/// no two arguments of one call may append to the same list.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh.h"
#include "sim/math/vector.h"

namespace substep::scenes {

using Json = nlohmann::ordered_json;

/// How a surface looks.
struct Finish {
  std::string_view name;
  std::array<double, 3> color;  ///< linear RGB
  double metallic = 0;
  double roughness = 0.5;
  bool double_sided = false;  ///< an open mesh of it collides on both sides
};

struct Motion {
  double mass = 1;  ///< kg
  std::optional<Vector3> inertia =
      {};  ///< principal moments along the node's axes, kg·m²; else of its colliders
  Quaternion inertia_orientation = Quaternion::Identity();  ///< of the principal axes in the node
  std::optional<Vector3> centre_of_mass = {};               ///< node space; else the colliders'
  Vector3 linear_velocity = Vector3::Zero();                ///< node space, m/s
  Vector3 angular_velocity = Vector3::Zero();               ///< node space, rad/s
  bool kinematic = false;                                   ///< keeps its velocity whatever happens
};

/// A bound on one, two or three axes of a joint, as in the extension. Hard without stiffness.
struct AxesLimit {
  enum class Kind { linear, angular } kind;
  std::vector<int> axes;
  std::optional<double> min = {};  ///< m or rad
  std::optional<double> max = {};
  std::optional<double> stiffness = {};  ///< N/m or N·m/rad
  double damping = 0;
};

/// A drive along or about one axis of a joint. `acceleration`: its numbers are per unit of mass or inertia.
struct AxisDrive {
  AxesLimit::Kind kind;
  int axis;
  bool acceleration = false;
  double position = 0;  ///< target, m or rad
  double velocity = 0;  ///< target, m/s or rad/s
  double stiffness = 0;
  double damping = 0;
  double max_force = 0;
};

/// A motor that turns about an axis of a joint.
struct VelocityDrive {
  int axis = 2;
  double velocity = 0;    ///< rad/s, of the joint's node relative to the connected one
  double damping = 0;     ///< N·m·s/rad
  double max_torque = 0;  ///< N·m
};

/// A figure that is known of the scene's motion: `extras.substep.expected` in scenes/format.md, whose keys
/// have the same names. What is left out is not written.
struct Known {
  std::string name = {};
  std::string_view quantity;
  std::vector<std::string> bodies = {};  ///< one is written as `body`
  std::string_view relative_to = {};
  std::optional<Vector3> direction = {};
  bool in_node = false;
  std::optional<Vector3> centre = {};
  std::optional<double> at = {};                     ///< s
  std::optional<std::array<double, 2>> mean = {};    ///< s
  std::optional<std::array<double, 2>> during = {};  ///< s, `throughout`
  int peak = 0;
  int crossing = 0;
  double level = 0;
  std::optional<double> stays = {};
  std::optional<double> value = {};
  std::optional<double> at_most = {};
  std::optional<double> at_least = {};
  double tolerance;
  std::string_view source;
};

class GltfBuilder {
 public:
  /// `extras.substep` of the scene.
  GltfBuilder(std::string_view name, double duration, const Vector3& gravity = Vector3(0, -9.81, 0),
              double step = 1.0 / 60);

  /// The sub-steps that a run takes unless told otherwise, where bodies' masses do not say it.
  void substeps(int count);

  /// The moment, in seconds, that a picture of the scene should show.
  void poster(double time);

  /// Adds to what is known of the scene's motion.
  void expect(const Known& known);
  /// No centre of these bodies, or of any, is ever further from its start than `tolerance`.
  void expect_standing(double tolerance, std::string_view source,
                       const std::vector<std::string>& bodies = {});
  /// A quantity of bodies along or about a direction, with its name in words ("": made of the rest).
  struct Measure {
    std::string name;
    std::string_view quantity;
    std::vector<std::string> bodies;
    Vector3 direction;
  };
  void expect_at(const Measure& measure, double time, double value, double tolerance,
                 std::string_view source);
  void expect_mean(const Measure& measure, const std::array<double, 2>& interval, double value,
                   double tolerance, std::string_view source);
  void expect_throughout(const Measure& measure, const std::array<double, 2>& interval, double value,
                         double tolerance, std::string_view source);
  /// The time of the crossing of 0 with this number, from 1.
  void expect_crossing(const Measure& measure, int crossing, double time, double tolerance,
                       std::string_view source);
  /// Nothing drives the scene and nothing in it takes energy: J, within `tolerance` of that at the start.
  void expect_constant_energy(double tolerance, std::string_view source);
  /// Nothing drives the scene and nothing in it gives energy: J, at most `tolerance` more than at the start.
  void expect_no_gain(double tolerance, std::string_view source);

  /// The same finish asked for again is the same material.
  int material(const Finish& finish);

  /// The vertices and triangles; several meshes may show them in different materials. Without normals it is
  /// drawn with flat faces.
  int geometry(const Mesh& mesh);
  struct Part {
    int geometry;
    int material;
  };
  int mesh(std::string_view name, const std::vector<Part>& parts);

  /// A node of the scene's tree; at the root without a parent.
  int node(std::string_view name, const Pose& pose = {}, std::optional<int> parent = {});
  /// A node that is not in the scene: what colliders refer to, never drawn.
  int detached_node(std::string_view name, int mesh);
  void show(int node, int mesh);
  /// Stretches what the node holds along its axes.
  void scale(int node, const Vector3& factors);

  int box_shape(const Vector3& size);
  int sphere_shape(double radius);
  /// Along Y; `height` is of the straight part.
  int capsule_shape(double radius, double height);
  int tapered_capsule_shape(double radius_bottom, double radius_top, double height);
  int cylinder_shape(double radius, double height);
  /// With a radius of 0 a cone.
  int tapered_cylinder_shape(double radius_bottom, double radius_top, double height);
  /// The plane y = 0 of its node, without end.
  int plane_shape();
  /// Where two materials meet, the smaller friction counts. No restitution.
  int physics_material(double friction);
  int physics_material(double static_friction, double dynamic_friction);
  /// Where two materials meet, the larger restitution counts, and the smaller friction.
  int bouncing_material(double restitution, double friction = 0);

  void motion(int node, const Motion& motion);
  void collider(int node, int shape, int physics_material);
  /// The convex hull of another node's mesh, in this node's place.
  void hull_collider(int node, int mesh_node, int physics_material);
  /// The triangles of a node's mesh, which may be this node itself: for what does not move.
  void mesh_collider(int node, int mesh_node, int physics_material);

  /// The collider of a node belongs to a system and meets only those of one other; of all, without one.
  void collide_as(int node, std::string_view system, std::optional<std::string_view> only_with = {});

  /// Joints keep two points together; the hinge leaves turning about the node's +Z too.
  int ball_joint();
  int hinge(const std::optional<VelocityDrive>& drive = {});
  int joint_description(const std::vector<AxesLimit>& limits, const std::vector<AxisDrive>& drives = {});
  /// Coordinates of limits and drives are those of `connected_node` in the frame of `node`.
  /// `collide`: the two bodies meet nevertheless.
  void joint(int node, int connected_node, int joint_description, bool collide = false);

  /// 16:9, from a point, towards a point, +Y up; `field_of_view` is vertical, rad.
  void camera(const Vector3& from, const Vector3& towards, double field_of_view);
  /// Directional light shining along `direction`, of `intensity` lux.
  void sun(const Vector3& direction, const std::array<double, 3>& linear_color, double intensity);

  /// The file: one line for each element of each list.
  std::string text() const;

 private:
  int revolved_shape(const char* type, double radius_bottom, double radius_top, double height);
  Json& extension(int node, const char* name) { return document_["nodes"][node]["extensions"][name]; }
  Json& physics(int node) { return extension(node, "KHR_physics_rigid_bodies"); }
  int append(Json& list, Json element);
  int accessor(std::string_view bytes, int target, int component_type, const char* type, std::size_t count);

  Json document_;
  std::string buffer_;
};

}  // namespace substep::scenes
