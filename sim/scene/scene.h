#pragma once
/// A loaded scene: bodies, colliders, joints, and data for drawing.
///
/// Bodies are placed by their *body frame*: origin at the centre of mass, axes along the principal axes of
/// inertia (report, II.6). Everything attached to a body (colliders, joint frames, visuals) is given in it.

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/geometry/mass_properties.h"
#include "sim/geometry/shape.h"
#include "sim/math/vector.h"
#include "sim/scene/expectation.h"

namespace substep {

/// Index of the world among bodies: it is body 0 of every scene, stands at the identity pose and never moves.
inline constexpr int world_body = 0;

struct Body {
  std::string name;                           ///< of its node; "node 7" where the file gives none
  double inverse_mass = 0;                    ///< 1/kg; 0 is infinite mass
  Vector3 inverse_inertia = Vector3::Zero();  ///< about the principal axes, 1/(kg m²); 0 is infinite
  double gravity_factor = 1;                  ///< multiple of the scene's gravity
  Pose body_from_node;  ///< node frame → body frame (rigid: the node's scale is in the shapes)
  // At t = 0:
  Pose pose;                                   ///< body frame → world
  Vector3 linear_velocity = Vector3::Zero();   ///< of the centre of mass, world, m/s
  Vector3 angular_velocity = Vector3::Zero();  ///< world, rad/s

  /// True where no force moves or turns it.
  bool is_kinematic() const { return inverse_mass == 0 && inverse_inertia.isZero(0); }
};

/// Rules for combining two materials' coefficients. Where two materials disagree, the first of these wins;
/// where neither states a mode, they are averaged.
enum class Combine { average, minimum, maximum, multiply, unstated };

struct ContactMaterial {
  double static_friction = 0.6;
  double dynamic_friction = 0.6;
  double restitution = 0;
  Combine friction_combine = Combine::unstated;
  Combine restitution_combine = Combine::unstated;
};

struct Collider {
  int body = world_body;
  Shape shape;
  Pose placement;  ///< shape's frame → body frame
  ContactMaterial material;
  /// Collision systems: bit i of `member` says that the collider is in system i, bit i of `collides_with`
  /// that it meets system i. A pair meets when each one's members are met by the other's.
  std::uint64_t member = 0;
  std::uint64_t collides_with = ~std::uint64_t{0};
  bool in_no_system = true;  ///< meets everything that does not exclude it
};

/// Limit of a joint on a set of its axes; see KHR_physics_rigid_bodies. Unbounded ends are infinite.
struct JointLimit {
  bool angular = false;
  std::array<bool, 3> axes{};  ///< x, y, z of frame a: coordinates are those of b in a
  double min = -infinity;      ///< m or rad
  double max = infinity;
  std::optional<double> stiffness;  ///< absent: hard. N/m or N·m/rad
  double damping = 0;               ///< N·s/m or N·m·s/rad
};

/// Motor of a joint along or about one axis; see KHR_physics_rigid_bodies.
struct JointDrive {
  bool angular = false;
  bool acceleration = false;  ///< mode: maximum, stiffness and damping are per unit of effective mass
  int axis = 0;
  double max_force = infinity;  ///< N or N·m
  double position_target = 0;   ///< m or rad
  double velocity_target = 0;   ///< m/s or rad/s
  double stiffness = 0;         ///< N/m or N·m/rad
  double damping = 0;           ///< N·s/m or N·m·s/rad
};

struct Joint {
  std::string name;         ///< of its node
  int body_a = world_body;  ///< the body that carries the joint's node
  int body_b = world_body;  ///< the body that carries `connectedNode`
  Pose frame_a;             ///< joint frame → body frame of a
  Pose frame_b;
  /// True where the two bodies collide. Otherwise they do not; a body that is joined to the world then does
  /// not collide with the world's colliders in `silent_colliders`.
  bool enable_collision = false;
  std::vector<int> silent_colliders;  ///< indices of Scene::colliders
  std::vector<JointLimit> limits;
  std::vector<JointDrive> drives;
};

/// An image as its file encodes it (PNG or JPEG); drawing decodes it.
struct SceneImage {
  std::string place;  ///< its file and pointer, for error messages: "crate.gltf: /images/0"
  std::shared_ptr<const std::string> bytes;
};

/// The way in which an image of the scene lies on a surface.
struct Texture {
  enum class Wrap { repeat, mirrored, clamped };
  enum class Levels { none, nearest, blended };  ///< of mipmaps; blended: between two levels

  int image = -1;       ///< index into Scene::images; −1: none
  int coordinates = 0;  ///< which set of its mesh's
  std::array<Wrap, 2> wrap{};
  bool is_sharp_near = false;  ///< magnified, it shows the nearest texel, not a mean of four
  bool is_sharp_far = false;   ///< minified, it shows the nearest texel
  Levels levels = Levels::blended;
  /// Position in the image = uv_matrix · coordinates + offset. Not aligned, as Quaternion.
  Eigen::Matrix<double, 2, 2, Eigen::DontAlign> uv_matrix = Eigen::Matrix2d::Identity();
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> offset = Eigen::Vector2d::Zero();
};

/// The material of a mesh.
struct Surface {
  enum class Opacity {
    opaque,
    cut,      ///< invisible where alpha is below the cut-off
    blended,  ///< over what is behind, by alpha
  };
  /// The property that each texture multiplies; a normal map replaces normals. Occlusion dims ambient light.
  enum Role { color_texture, finish_texture, normal_texture, occlusion_texture, emission_texture };

  std::string name;
  std::array<double, 3> base_color{0.8, 0.8, 0.8};  ///< linear RGB
  double metallic = 0;
  double roughness = 0.6;
  double alpha = 1;
  Opacity opacity = Opacity::opaque;
  double cut_off = 0.5;
  std::array<double, 3> emission{};  ///< linear RGB radiance; a white surface in full light has 1
  bool is_unlit = false;             ///< shows its base colour whatever the light
  bool is_double_sided = true;       ///< is seen from behind too
  double normal_scale = 1;
  double occlusion_strength = 1;
  std::array<Texture, 5> textures;  ///< by Role
};

/// Vertex attributes for drawing; each list has one per position, or is empty.
struct VertexAttributes {
  std::array<std::vector<std::array<float, 2>>, 2> texture_coordinates;
  std::vector<std::array<float, 4>> colors;    ///< linear RGBA, which multiply the surface's
  std::vector<std::array<float, 4>> tangents;  ///< unit, of the first coordinate; w: ±1, the handedness
};

/// A triangle mesh with one surface, for drawing.
struct Mesh {
  std::string name;
  std::vector<Vector3> positions;
  std::vector<Vector3> normals;  ///< one per position, unit
  std::vector<Triangle> triangles;
  int surface = 0;  ///< index into Scene::surfaces; −1: none given, so each body has a colour of its own
  VertexAttributes attributes;
};

/// A mesh attached to a body. x_body = linear * x_mesh + translation (linear holds the node's scale).
struct Visual {
  int mesh = 0;
  int body = world_body;
  Matrix3 linear = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
};

/// A camera as in glTF: it looks along its −Z, with +Y up.
struct Camera {
  Pose pose;                            ///< camera → world
  double vertical_field_of_view = 0.8;  ///< rad
};

/// Light from infinitely far; the default is the sun of scenes without any light.
struct Sun {
  Vector3 direction{-0.55, -1, -0.45};         ///< towards which it shines, world
  std::array<double, 3> color{1, 0.95, 0.88};  ///< linear RGB
  double illuminance = 3;                      ///< of a surface facing it; π exposes a white surface fully
};

/// Any other light of a file.
struct Light {
  enum class Kind { directional, point, spot };

  Kind kind = Kind::point;
  Vector3 position = Vector3::Zero();
  Vector3 direction{0, 0, -1};  ///< unit, towards which it shines; unused by a point light
  std::array<double, 3> color{1, 1, 1};
  double intensity = 1;     ///< illuminance as the sun's, or illuminance at 1 m
  double range = infinity;  ///< m; no light beyond
  double inner_angle = 0;   ///< rad from the axis of a spot: full light within it
  double outer_angle = 0;   ///< rad from the axis of a spot: no light beyond it
};

struct NamedCamera {
  std::string node;    ///< name of its node, which no other has
  std::string camera;  ///< name of the camera that the node holds; may be empty
  Camera view;
};

struct Scene {
  std::string name;  ///< file name without extension
  std::filesystem::path file;
  /// Hash of the file and its buffers' files: 64-bit FNV-1a of a .gltf's text and of the XXH3 of all other
  /// bytes.
  std::uint64_t hash = 0;
  Vector3 gravity{0, -9.81, 0};       ///< m/s²
  double duration = 5;                ///< s
  double step = 1.0 / 60;             ///< s, default of runs
  int substeps = 10;                  ///< default n of A3 to A5; of A2 see usual_settings.h
  std::optional<double> poster;       ///< s, time of the picture that represents the scene
  bool gyroscopic = true;             ///< unequal moments of inertia give a gyroscopic term
  std::vector<Expectation> expected;  ///< expectations of the motion

  std::vector<Body> bodies;  ///< bodies[0] is the world
  std::vector<Collider> colliders;
  std::vector<Joint> joints;

  std::vector<Surface> surfaces;
  std::vector<Mesh> meshes;
  std::vector<Visual> visuals;
  std::vector<SceneImage> images;
  std::optional<Camera> camera;      ///< the first of `cameras`
  std::vector<NamedCamera> cameras;  ///< in the order of the file
  std::optional<Sun> sun;
  std::vector<Light> lights;  ///< without the sun; a scene with lights but no sun gets no default sun

  std::vector<std::string> warnings;  ///< ignored keys, replaced requests, suspicious values
};

}  // namespace substep
