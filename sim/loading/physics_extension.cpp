#include "sim/loading/physics_extension.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace substep {
namespace {

constexpr const char* rigid_bodies = "KHR_physics_rigid_bodies";
constexpr const char* implicit_shapes = "KHR_implicit_shapes";

double read_size(const JsonValue& object, const char* key, double otherwise) {
  return get(object, key, otherwise, &JsonValue::positive);
}

// A bottom and a top radius, not both 0.
void read_radii(const JsonValue& object, ImplicitShape& shape) {
  shape.radius_bottom = get(object, "radiusBottom", 0.25, &JsonValue::non_negative);
  shape.radius_top = get(object, "radiusTop", 0.25, &JsonValue::non_negative);
  if (shape.radius_bottom == 0 && shape.radius_top == 0) object.fail("has radius 0 at both ends");
}

/// Types of shapes, and the keys of each.
const std::map<std::string_view, std::vector<std::string_view>> shape_keys{
    {"sphere", {"radius"}},
    {"box", {"size"}},
    {"capsule", {"height", "radiusBottom", "radiusTop"}},
    {"cylinder", {"height", "radiusBottom", "radiusTop"}},
    {"plane", {"sizeX", "sizeZ", "doubleSided"}},
    {"convex", {"mesh"}},
    {"concave", {"mesh"}}};

ImplicitShape read_shape(const JsonValue& json, const DocumentSizes& sizes,
                         std::vector<std::string>& warnings) {
  ImplicitShape shape;
  const JsonValue type = json.require("type");
  const nlohmann::json none = nlohmann::json::object();
  const std::string& name = type.text();
  const auto given = json.find(name.c_str());
  const std::string no_file;
  const JsonValue values = given ? *given : JsonValue(none, no_file);
  json.warn_of_unknown({"type", "sphere", "box", "capsule", "cylinder", "plane", "convex", "concave"},
                       warnings);
  if (const auto keys = shape_keys.find(name); keys != shape_keys.end())
    values.warn_of_unknown(keys->second, warnings);
  if (name == "sphere") {
    shape.kind = ImplicitShape::Kind::sphere;
    shape.radius_bottom = shape.radius_top = read_size(values, "radius", 0.5);
  } else if (name == "box") {
    shape.kind = ImplicitShape::Kind::box;
    shape.size = get(values, "size", Vector3(1, 1, 1), &JsonValue::vector3);
    if (!(shape.size.minCoeff() > 0)) values.require("size").fail("must be three numbers greater than 0");
  } else if (name == "capsule") {
    shape.kind = ImplicitShape::Kind::capsule;
    shape.height = get(values, "height", 0.5, &JsonValue::non_negative);
    read_radii(values, shape);
  } else if (name == "cylinder") {
    shape.kind = ImplicitShape::Kind::cylinder;
    shape.height = read_size(values, "height", 0.5);
    read_radii(values, shape);
  } else if (name == "plane") {
    shape.kind = ImplicitShape::Kind::plane;
    shape.plane_size = {read_size(values, "sizeX", shape.plane_size[0]),
                        read_size(values, "sizeZ", shape.plane_size[1])};
    shape.double_sided = get(values, "doubleSided", false, &JsonValue::boolean);
  } else if (name == "convex" || name == "concave") {
    shape.kind = ImplicitShape::Kind::mesh;
    shape.mesh = json.require(name.c_str()).require("mesh").index(sizes.meshes, "mesh");
    shape.convex_hull = name == "convex";
  } else {
    type.fail(fmt::format(
        "unknown shape '{}'; known are sphere, box, capsule, cylinder, plane, convex, concave", name));
  }
  for (const char* other : {"sphere", "box", "capsule", "cylinder", "plane", "convex", "concave"}) {
    if (name != other && json.find(other)) {
      json.fail(fmt::format("is a {}, but also has '{}': a shape has the measures of its own type alone",
                            name, other));
    }
  }
  return shape;
}

Combine read_combine(const JsonValue& material, const char* key) {
  const auto value = material.find(key);
  if (!value) return Combine::unstated;
  const std::string& name = value->text();
  if (name == "average") return Combine::average;
  if (name == "minimum") return Combine::minimum;
  if (name == "maximum") return Combine::maximum;
  if (name == "multiply") return Combine::multiply;
  value->fail(fmt::format("unknown '{}'; known are average, minimum, maximum, multiply", name));
}

ContactMaterial read_material(const JsonValue& json, std::vector<std::string>& warnings) {
  json.warn_of_unknown(
      {"staticFriction", "dynamicFriction", "restitution", "frictionCombine", "restitutionCombine"},
      warnings);
  ContactMaterial material;
  material.static_friction = get(json, "staticFriction", 0.6, &JsonValue::non_negative);
  material.dynamic_friction = get(json, "dynamicFriction", 0.6, &JsonValue::non_negative);
  material.restitution = get(json, "restitution", 0.0, &JsonValue::non_negative);
  if (material.restitution > 1) {
    json.require("restitution").fail(fmt::format("must be at most 1, but is {}", material.restitution));
  }
  material.friction_combine = read_combine(json, "frictionCombine");
  material.restitution_combine = read_combine(json, "restitutionCombine");
  return material;
}

// Collision systems are named by any text; each gets a bit in the order of first mention.
class SystemNames {
 public:
  std::uint64_t read(const JsonValue& list) {
    std::uint64_t bits = 0;
    for (const JsonValue& name : list.items()) bits |= bit(name);
    return bits;
  }

 private:
  std::uint64_t bit(const JsonValue& name) {
    auto found = std::find(names_.begin(), names_.end(), name.text());
    if (found == names_.end()) {
      if (names_.size() == 64)
        name.fail("the file names more than 64 collision systems, the most that are read");
      found = names_.insert(found, name.text());
    }
    return std::uint64_t{1} << (found - names_.begin());
  }

  std::vector<std::string> names_;
};

CollisionFilter read_filter(const JsonValue& json, SystemNames& names, std::vector<std::string>& warnings) {
  json.warn_of_unknown({"collisionSystems", "collideWithSystems", "notCollideWithSystems"}, warnings);
  CollisionFilter filter;
  if (const auto member = json.find("collisionSystems")) filter.member = names.read(*member);
  const auto with = json.find("collideWithSystems");
  const auto without = json.find("notCollideWithSystems");
  if (with && without) json.fail("has both 'collideWithSystems' and 'notCollideWithSystems'; keep one");
  if (with) filter.collides_with = names.read(*with);
  if (without) filter.collides_with = ~names.read(*without);
  return filter;
}

JointLimit read_limit(const JsonValue& json, std::vector<std::string>& warnings) {
  json.warn_of_unknown({"linearAxes", "angularAxes", "min", "max", "stiffness", "damping"}, warnings);
  JointLimit limit;
  const auto linear = json.find("linearAxes");
  const auto angular = json.find("angularAxes");
  if (linear.has_value() == angular.has_value()) json.fail("must have one of 'linearAxes' and 'angularAxes'");
  limit.angular = angular.has_value();
  const JsonValue axes = linear ? *linear : *angular;
  for (const JsonValue& axis : axes.items()) {
    const std::uint64_t index = axis.integer(2);
    if (limit.axes[index]) axis.fail(fmt::format("names axis {} again", index));
    limit.axes[index] = true;
  }
  if (axes.json().empty()) axes.fail("names no axis");
  limit.min = get(json, "min", limit.min, &JsonValue::number);
  limit.max = get(json, "max", limit.max, &JsonValue::number);
  if (limit.min > limit.max) json.fail(fmt::format("has min {} above max {}", limit.min, limit.max));
  if (const auto stiffness = json.find("stiffness")) limit.stiffness = stiffness->non_negative();
  limit.damping = get(json, "damping", 0.0, &JsonValue::non_negative);
  return limit;
}

bool read_choice(const JsonValue& json, const char* yes, const char* no) {
  const std::string& name = json.text();
  if (name != yes && name != no) json.fail(fmt::format("must be '{}' or '{}', but is '{}'", no, yes, name));
  return name == yes;
}

JointDrive read_drive(const JsonValue& json, std::vector<std::string>& warnings) {
  json.warn_of_unknown(
      {"type", "mode", "axis", "maxForce", "positionTarget", "velocityTarget", "stiffness", "damping"},
      warnings);
  JointDrive drive;
  drive.angular = read_choice(json.require("type"), "angular", "linear");
  drive.acceleration = read_choice(json.require("mode"), "acceleration", "force");
  drive.axis = static_cast<int>(json.require("axis").integer(2));
  drive.max_force = get(json, "maxForce", drive.max_force, &JsonValue::non_negative);
  drive.position_target = get(json, "positionTarget", 0.0, &JsonValue::number);
  drive.velocity_target = get(json, "velocityTarget", 0.0, &JsonValue::number);
  drive.stiffness = get(json, "stiffness", 0.0, &JsonValue::non_negative);
  drive.damping = get(json, "damping", 0.0, &JsonValue::non_negative);
  if (drive.position_target != 0 && drive.stiffness == 0) {
    warnings.push_back(json.path() + ": positionTarget has no effect without stiffness");
  }
  if (drive.velocity_target != 0 && drive.damping == 0) {
    warnings.push_back(json.path() + ": velocityTarget has no effect without damping");
  }
  return drive;
}

// Every joint node has a copy of its description.
std::vector<JsonValue> few_items(const JsonValue& list) {
  constexpr std::size_t most = 100;
  std::vector<JsonValue> items = list.items();
  if (items.size() > most)
    list.fail(fmt::format("has {} entries; the most that is read is {}", items.size(), most));
  return items;
}

JointDescription read_joint(const JsonValue& json, std::vector<std::string>& warnings) {
  json.warn_of_unknown({"limits", "drives"}, warnings);
  JointDescription joint;
  if (const auto limits = json.find("limits")) {
    for (const JsonValue& limit : few_items(*limits)) joint.limits.push_back(read_limit(limit, warnings));
  }
  if (const auto drives = json.find("drives")) {
    for (const JsonValue& drive : few_items(*drives)) joint.drives.push_back(read_drive(drive, warnings));
  }
  return joint;
}

std::vector<JsonValue> list(const std::optional<JsonValue>& extension, const char* key) {
  const auto found = extension ? extension->find(key) : std::nullopt;
  return found ? found->items() : std::vector<JsonValue>{};
}

MotionProperties read_motion(const JsonValue& json, std::vector<std::string>& warnings) {
  json.warn_of_unknown({"isKinematic", "mass", "centerOfMass", "inertiaDiagonal", "inertiaOrientation",
                        "linearVelocity", "angularVelocity", "gravityFactor"},
                       warnings);
  MotionProperties motion;
  motion.kinematic = get(json, "isKinematic", false, &JsonValue::boolean);
  if (const auto mass = json.find("mass")) motion.mass = mass->non_negative();
  if (const auto centre = json.find("centerOfMass")) motion.centre_of_mass = centre->vector3();
  if (const auto inertia = json.find("inertiaDiagonal")) {
    motion.inertia_diagonal = inertia->vector3();
    if (motion.inertia_diagonal->minCoeff() < 0) inertia->fail("must not have a negative component");
  }
  motion.inertia_orientation =
      get(json, "inertiaOrientation", motion.inertia_orientation, &JsonValue::rotation);
  motion.linear_velocity = get(json, "linearVelocity", motion.linear_velocity, &JsonValue::vector3);
  motion.angular_velocity = get(json, "angularVelocity", motion.angular_velocity, &JsonValue::vector3);
  motion.gravity_factor = get(json, "gravityFactor", 1.0, &JsonValue::number);
  return motion;
}

// A collider, or a trigger, which has the same keys but no material.
ColliderProperties read_collider(const JsonValue& json, const PhysicsTables& tables,
                                 const DocumentSizes& sizes, std::vector<std::string>& warnings) {
  json.warn_of_unknown({"geometry", "physicsMaterial", "collisionFilter"}, warnings);
  ColliderProperties collider;
  const JsonValue geometry = json.require("geometry");
  geometry.warn_of_unknown({"shape", "node", "mesh", "convexHull"}, warnings);
  const auto shape = geometry.find("shape");
  const auto node = geometry.find("node");
  const auto mesh = geometry.find("mesh");
  if (shape.has_value() + node.has_value() + mesh.has_value() != 1)
    geometry.fail("must have one of 'shape', 'node' and 'mesh'");
  if (shape) collider.shape = shape->index(tables.shapes.size(), "implicit shape");
  if (node) collider.node = node->index(sizes.nodes, "node");
  if (mesh) collider.mesh = mesh->index(sizes.meshes, "mesh");
  collider.convex_hull = get(geometry, "convexHull", false, &JsonValue::boolean);
  if (shape && tables.shapes[collider.shape].kind == ImplicitShape::Kind::mesh) {
    collider.mesh = tables.shapes[collider.shape].mesh;
    collider.convex_hull = tables.shapes[collider.shape].convex_hull;
    collider.shape = -1;
  }
  if (const auto material = json.find("physicsMaterial")) {
    collider.material = material->index(tables.materials.size(), "physics material");
  }
  if (const auto filter = json.find("collisionFilter")) {
    collider.filter = filter->index(tables.filters.size(), "collision filter");
  }
  return collider;
}

}  // namespace

PhysicsTables read_physics_tables(const JsonValue& root, const DocumentSizes& sizes,
                                  std::vector<std::string>& warnings) {
  PhysicsTables tables;
  const auto bodies = root.extension(rigid_bodies);
  const auto shapes = root.extension(implicit_shapes);
  if (bodies) {
    bodies->warn_of_unknown({"physicsMaterials", "collisionFilters", "physicsJoints"}, warnings);
  }
  if (shapes) shapes->warn_of_unknown({"shapes"}, warnings);
  const auto core = root.find("shapes");
  if (shapes && core)
    warnings.push_back(core->path() + ": are ignored: the file has those of KHR_implicit_shapes too");
  for (const JsonValue& shape : list(shapes ? shapes : std::optional(root), "shapes")) {
    tables.shapes.push_back(read_shape(shape, sizes, warnings));
  }
  for (const JsonValue& material : list(bodies, "physicsMaterials")) {
    tables.materials.push_back(read_material(material, warnings));
  }
  SystemNames names;
  for (const JsonValue& filter : list(bodies, "collisionFilters")) {
    tables.filters.push_back(read_filter(filter, names, warnings));
  }
  for (const JsonValue& joint : list(bodies, "physicsJoints")) {
    tables.joints.push_back(read_joint(joint, warnings));
  }
  return tables;
}

NodePhysics read_node_physics(const JsonValue& node, const PhysicsTables& tables, const DocumentSizes& sizes,
                              std::vector<std::string>& warnings) {
  NodePhysics physics;
  const auto extension = node.extension(rigid_bodies);
  if (!extension) return physics;
  extension->warn_of_unknown({"motion", "collider", "trigger", "joint"}, warnings);
  if (const auto motion = extension->find("motion")) physics.motion = read_motion(*motion, warnings);
  if (const auto collider = extension->find("collider")) {
    physics.collider = read_collider(*collider, tables, sizes, warnings);
  }
  if (const auto trigger = extension->find("trigger")) {
    physics.trigger = true;
    if (const auto parts = trigger->find("nodes")) {
      for (const JsonValue& part : parts->items()) part.index(sizes.nodes, "node");
    } else {
      read_collider(*trigger, tables, sizes, warnings);
    }
  }
  if (const auto joint = extension->find("joint")) {
    joint->warn_of_unknown({"connectedNode", "joint", "enableCollision"}, warnings);
    physics.joint = JointProperties{joint->require("connectedNode").index(sizes.nodes, "node"),
                                    joint->require("joint").index(tables.joints.size(), "physics joint"),
                                    get(*joint, "enableCollision", false, &JsonValue::boolean)};
  }
  return physics;
}

}  // namespace substep
