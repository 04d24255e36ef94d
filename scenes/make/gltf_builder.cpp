#include "gltf_builder.h"

#include "sim/error.h"
#include "sim/math/base64.h"

namespace substep::scenes {
namespace {

// Names of the glTF specification.
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;
constexpr int unsigned_short = 5123;
constexpr int single_float = 5126;

constexpr const char* rigid_bodies = "KHR_physics_rigid_bodies";
constexpr const char* implicit_shapes = "KHR_implicit_shapes";
constexpr const char* lights = "KHR_lights_punctual";

// Replaces −0, which would be written as "-0.0".
double positive_zero(double x) {
  return x + 0.0;
}

Eigen::Vector3f stored(const Vector3& v) {
  return v.unaryExpr(&positive_zero).cast<float>();
}

Json to_json(const Vector3& v) {
  return {positive_zero(v.x()), positive_zero(v.y()), positive_zero(v.z())};
}

Json to_json(const Quaternion& q) {
  return {positive_zero(q.x()), positive_zero(q.y()), positive_zero(q.z()), positive_zero(q.w())};
}

template <typename Number>
void append_number(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Returns the orientation of a node whose −Z points along `direction` and whose +Y is nearest to up.
Quaternion looking_along(const Vector3& direction) {
  Matrix3 axes;
  axes.col(2) = -direction.normalized();
  axes.col(0) = Vector3::UnitY().cross(axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return Quaternion(axes).normalized();
}

int append(Json& list, Json element) {
  list.push_back(std::move(element));
  return static_cast<int>(list.size()) - 1;
}

}  // namespace

GltfBuilder::GltfBuilder(std::string_view name, const Run& run, const Stage& stage) : name_(name) {
  // Write the keys in this order, whatever the order of their first use.
  for (const char* key : {"asset", "extensionsUsed", "scene", "scenes", "nodes", "cameras", "extensions",
                          "materials", "meshes", "accessors", "bufferViews", "buffers"})
    document_[key] = nullptr;
  document_["extensions"] = {{rigid_bodies, nullptr}, {implicit_shapes, nullptr}, {lights, nullptr}};
  document_["asset"] = {
      {"version", "2.0"}, {"generator", "substep make_scenes"}, {"copyright", "MIT licence"}};
  document_["extensionsUsed"] = {rigid_bodies, implicit_shapes, lights};
  document_["scene"] = 0;
  document_["scenes"] = Json::array({{{"name", name}, {"nodes", Json::array()}}});
  document_["nodes"] = Json::array();
  settings() = {{"gravity", to_json(run.gravity)}, {"duration", run.duration}, {"step", run.step}};
  if (run.substeps) settings()["substeps"] = *run.substeps;
  if (run.poster) settings()["poster"] = *run.poster;
  const Json lens = {{"aspectRatio", 16.0 / 9}, {"yfov", stage.yfov}, {"znear", 0.05}, {"zfar", 200.0}};
  const int eye = node("camera", {stage.eye, looking_along(stage.target - stage.eye)});
  document_["nodes"][eye]["camera"] =
      append(document_["cameras"], {{"type", "perspective"}, {"perspective", lens}});
  // The sun is warm white, of 3 lux.
  const Json sun = {{"type", "directional"}, {"color", {1.0, 0.95, 0.86}}, {"intensity", 3.0}};
  extension(node("sun", {Vector3::Zero(), looking_along(stage.light)}), lights)["light"] =
      append(document_["extensions"][lights]["lights"], sun);
  if (stage.friction) ground(physics_material(*stage.friction));
}

void GltfBuilder::expect(const Quantity& quantity, const Json& when, const Bound& bound, double tolerance,
                         std::string_view source) {
  Json json;
  if (!quantity.name.empty()) json["name"] = quantity.name;
  json["quantity"] = quantity.quantity;
  if (quantity.bodies.size() == 1) json["body"] = quantity.bodies[0];
  if (quantity.bodies.size() > 1) json["bodies"] = quantity.bodies;
  if (!quantity.relative_to.empty()) json["relative_to"] = quantity.relative_to;
  if (quantity.direction) json["direction"] = to_json(*quantity.direction);
  if (quantity.in_node) json["frame"] = "node";
  json.update(when);
  json[bound.key] = positive_zero(bound.value);
  json["tolerance"] = tolerance;
  json["source"] = source;
  settings()["expected"].push_back(json);
}

void GltfBuilder::expect_standing(double tolerance, std::string_view source,
                                  const std::vector<std::string>& bodies) {
  std::string who = bodies.empty() ? "any body" : bodies.front();
  if (bodies.size() > 1) who += (bodies.size() == 2 ? " and " : " … ") + bodies.back();
  expect({"largest displacement of " + who, "displacement", bodies}, any_time, 0, tolerance, source);
}

void GltfBuilder::expect_constant_energy(double tolerance, std::string_view source) {
  expect({"largest change of energy", "energy_change"}, any_time, 0, tolerance, source);
}

void GltfBuilder::expect_no_gain(double tolerance, std::string_view source) {
  expect({"largest rise of energy", "energy_change"}, any_time, at_most(0), tolerance, source);
}

int GltfBuilder::material(const Finish& finish) {
  Json& materials = document_["materials"];
  for (std::size_t i = 0; i < materials.size(); ++i)
    if (materials[i]["name"] == finish.name) return static_cast<int>(i);
  Json json = {{"name", finish.name},
               {"pbrMetallicRoughness",
                {{"baseColorFactor", {finish.color[0], finish.color[1], finish.color[2], 1.0}},
                 {"metallicFactor", finish.metallic},
                 {"roughnessFactor", finish.roughness}}}};
  if (finish.double_sided) json["doubleSided"] = true;
  return append(materials, json);
}

int GltfBuilder::accessor(std::string_view bytes, int target, int component_type, const char* type,
                          std::size_t count) {
  while (buffer_.size() % 4 != 0) buffer_.push_back('\0');
  const int view = append(
      document_["bufferViews"],
      {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}, {"target", target}});
  buffer_ += bytes;
  return append(document_["accessors"],
                {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}});
}

int GltfBuilder::geometry(const Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  if (count > 65535) throw Error("a mesh has more vertices than 16-bit indices reach");
  std::string positions, normals, indices;
  Eigen::AlignedBox3f bounds;
  for (const Vector3& point : mesh.positions) {
    bounds.extend(stored(point));
    append_number(positions, stored(point));
  }
  for (const Vector3& normal : mesh.normals) append_number(normals, stored(normal));
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) append_number(indices, static_cast<std::uint16_t>(vertex));

  const int position = accessor(positions, array_buffer, single_float, "VEC3", count);
  // Bounds are the stored floats exactly, as the specification asks.
  document_["accessors"][position]["min"] = to_json(bounds.min().cast<double>());
  document_["accessors"][position]["max"] = to_json(bounds.max().cast<double>());
  if (!mesh.normals.empty()) accessor(normals, array_buffer, single_float, "VEC3", count);
  accessor(indices, element_array_buffer, unsigned_short, "SCALAR", 3 * mesh.triangles.size());
  return position;
}

int GltfBuilder::mesh(std::string_view name, const std::vector<Primitive>& primitives) {
  Json array = Json::array();
  for (const Primitive& primitive : primitives) {
    const Mesh* const made = std::get_if<Mesh>(&primitive.geometry);
    const int positions = made ? geometry(*made) : std::get<int>(primitive.geometry);
    // geometry() stores normals, if any, and indices after the positions.
    const bool has_normals = document_["accessors"][positions + 1]["type"] == "VEC3";
    Json attributes = {{"POSITION", positions}};
    if (has_normals) attributes["NORMAL"] = positions + 1;
    array.push_back({{"attributes", attributes},
                     {"indices", positions + (has_normals ? 2 : 1)},
                     {"material", material(primitive.finish)}});
  }
  return append(document_["meshes"], {{"name", name}, {"primitives", array}});
}

int GltfBuilder::node(std::string_view name, const Pose& pose, std::optional<int> parent) {
  Json json = {{"name", name}};
  if (pose.position != Vector3::Zero()) json["translation"] = to_json(pose.position);
  if (pose.orientation.vec() != Vector3::Zero()) json["rotation"] = to_json(pose.orientation);
  const int index = append(document_["nodes"], json);
  if (parent)
    document_["nodes"][*parent]["children"].push_back(index);
  else
    document_["scenes"][0]["nodes"].push_back(index);
  return index;
}

int GltfBuilder::detached_node(const std::string& name, const NodeMesh& look) {
  const int index = look.primitives.empty() ? look.mesh : mesh(name, look.primitives);
  return append(document_["nodes"], {{"name", name}, {"mesh", index}});
}

void GltfBuilder::show(int node, const NodeMesh& look) {
  const std::string name = document_["nodes"][node]["name"];
  document_["nodes"][node]["mesh"] = look.primitives.empty() ? look.mesh : mesh(name, look.primitives);
}

void GltfBuilder::scale(int node, const Vector3& factors) {
  document_["nodes"][node]["scale"] = to_json(factors);
}

int GltfBuilder::body(std::string_view name, const Pose& pose, const Motion& motion, const Collider& collider,
                      const NodeMesh& look, std::optional<int> parent) {
  const int index = body(name, pose, motion, look, parent);
  this->collider(index, collider);
  return index;
}

int GltfBuilder::body(std::string_view name, const Pose& pose, const Motion& motion, const NodeMesh& look,
                      std::optional<int> parent) {
  const int index = node(name, pose, parent);
  this->motion(index, motion);
  show(index, look);
  return index;
}

int GltfBuilder::fixed_body(std::string_view name, const Pose& pose, const Collider& collider,
                            const NodeMesh& look, std::optional<int> parent) {
  const int index = node(name, pose, parent);
  this->collider(index, collider);
  show(index, look);
  return index;
}

int GltfBuilder::fixed_box(std::string_view name, const Vector3& size, const Pose& pose, int physics_material,
                           const Finish& finish, double rounding) {
  return fixed_body(name, pose, {box_shape(size), physics_material}, {{cuboid(size, rounding), finish}});
}

int GltfBuilder::scenery(std::string_view name, const NodeMesh& look, const Pose& pose,
                         std::optional<int> parent) {
  const int index = node(name, pose, parent);
  show(index, look);
  return index;
}

void GltfBuilder::ground(int physics_material) {
  collider(node("ground"), {shape("plane", Json::object()), physics_material});
}

int GltfBuilder::shape(const char* type, const Json& json) {
  return append(document_["extensions"][implicit_shapes]["shapes"], {{"type", type}, {type, json}});
}

int GltfBuilder::box_shape(const Vector3& size) {
  return shape("box", {{"size", to_json(size)}});
}

int GltfBuilder::sphere_shape(double radius) {
  return shape("sphere", {{"radius", radius}});
}

int GltfBuilder::capsule_shape(double radius_bottom, double radius_top, double height) {
  return shape("capsule", {{"height", height}, {"radiusBottom", radius_bottom}, {"radiusTop", radius_top}});
}

int GltfBuilder::cylinder_shape(double radius_bottom, double radius_top, double height) {
  return shape("cylinder", {{"height", height}, {"radiusBottom", radius_bottom}, {"radiusTop", radius_top}});
}

int GltfBuilder::surface(double static_friction, double dynamic_friction, double restitution,
                         const char* combine) {
  return append(document_["extensions"][rigid_bodies]["physicsMaterials"],
                {{"staticFriction", static_friction},
                 {"dynamicFriction", dynamic_friction},
                 {"restitution", restitution},
                 {"frictionCombine", "minimum"},
                 {"restitutionCombine", combine}});
}

int GltfBuilder::physics_material(double static_friction, std::optional<double> dynamic_friction) {
  return surface(static_friction, dynamic_friction.value_or(static_friction), 0, "minimum");
}

int GltfBuilder::bouncing_material(double restitution, double friction) {
  return surface(friction, friction, restitution, "maximum");
}

void GltfBuilder::motion(int node, const Motion& motion) {
  Json json = {{"mass", motion.mass}};
  if (motion.kinematic) json["isKinematic"] = true;
  if (motion.inertia) json["inertiaDiagonal"] = to_json(*motion.inertia);
  if (motion.inertia_orientation.vec() != Vector3::Zero())
    json["inertiaOrientation"] = to_json(motion.inertia_orientation);
  if (motion.centre_of_mass) json["centerOfMass"] = to_json(*motion.centre_of_mass);
  if (motion.linear_velocity != Vector3::Zero()) json["linearVelocity"] = to_json(motion.linear_velocity);
  if (motion.angular_velocity != Vector3::Zero()) json["angularVelocity"] = to_json(motion.angular_velocity);
  extension(node, rigid_bodies)["motion"] = json;
}

void GltfBuilder::collider(int node, const Collider& collider) {
  Json geometry = {{collider.kind == Collider::Kind::shape ? "shape" : "node", collider.geometry}};
  if (collider.kind == Collider::Kind::hull) geometry["convexHull"] = true;
  extension(node, rigid_bodies)["collider"] = {{"geometry", geometry},
                                               {"physicsMaterial", collider.material}};
}

void GltfBuilder::collide_as(int node, std::string_view system, std::optional<std::string_view> only_with) {
  Json filter = {{"collisionSystems", Json::array({system})}};
  if (only_with) filter["collideWithSystems"] = Json::array({*only_with});
  extension(node, rigid_bodies)["collider"]["collisionFilter"] =
      append(document_["extensions"][rigid_bodies]["collisionFilters"], filter);
}

int GltfBuilder::hinge(const std::vector<AxisDrive>& drives) {
  using enum AxesLimit::Kind;
  return joint_description({locked(linear, {0, 1, 2}), locked(angular, {0, 1})}, drives);
}

int GltfBuilder::joint_description(const std::vector<AxesLimit>& limits,
                                   const std::vector<AxisDrive>& drives) {
  Json json = {{"limits", Json::array()}};
  for (const AxesLimit& limit : limits) {
    Json element = {{limit.kind == AxesLimit::Kind::linear ? "linearAxes" : "angularAxes", limit.axes}};
    if (limit.min) element["min"] = *limit.min;
    if (limit.max) element["max"] = *limit.max;
    if (limit.stiffness) {
      element["stiffness"] = *limit.stiffness;
      element["damping"] = limit.damping;
    }
    json["limits"].push_back(element);
  }
  for (const AxisDrive& drive : drives) {
    Json element = {{"type", drive.kind == AxesLimit::Kind::linear ? "linear" : "angular"},
                    {"mode", drive.acceleration ? "acceleration" : "force"},
                    {"axis", drive.axis},
                    {"maxForce", drive.max_force}};
    if (drive.stiffness > 0) {
      element["positionTarget"] = drive.position;
      element["stiffness"] = drive.stiffness;
    }
    element["velocityTarget"] = drive.velocity;
    element["damping"] = drive.damping;
    json["drives"].push_back(element);
  }
  return append(document_["extensions"][rigid_bodies]["physicsJoints"], json);
}

void GltfBuilder::joint(int node, int connected_node, int joint_description, bool collide) {
  Json& joint = extension(node, rigid_bodies)["joint"];
  joint = {{"connectedNode", connected_node}, {"joint", joint_description}};
  if (collide) joint["enableCollision"] = true;
}

int GltfBuilder::add_link(int number, int body, double length, int end, int joint_description) {
  joint(node("joint_" + std::to_string(number), at(-length / 2, 0, 0), body), end, joint_description);
  return node("end_" + std::to_string(number), at(length / 2, 0, 0), body);
}

std::string GltfBuilder::text() const {
  Json document = document_;
  document["buffers"] = Json::array(
      {{{"byteLength", buffer_.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer_)}}});
  for (const char* key : {rigid_bodies, implicit_shapes})
    if (document["extensions"][key].is_null()) document["extensions"].erase(key);

  std::string text = "{";
  for (const auto& [key, value] : document.items()) {
    text += (text.size() == 1 ? "\n" : ",\n") + Json(key).dump() + ": ";
    if (!value.is_array() || !value[0].is_object()) {
      text += value.dump();
      continue;
    }
    text += '[';
    for (std::size_t i = 0; i < value.size(); ++i) text += (i == 0 ? "\n  " : ",\n  ") + value[i].dump();
    text += "\n]";
  }
  return text + "\n}\n";
}

}  // namespace substep::scenes
