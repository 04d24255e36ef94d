#include "sim/loading/physics_extension.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace substep {
namespace {

constexpr const char* rigid_bodies = "KHR_physics_rigid_bodies";

using Kind = ImplicitShape::Kind;

struct ShapeType {
  Kind kind;
  std::vector<std::string_view> keys;
};

/// Types of shapes, and the keys of each.
const std::vector<std::pair<const char*, ShapeType>> shape_types{
    {"sphere", {Kind::sphere, {"radius"}}},
    {"box", {Kind::box, {"size"}}},
    {"capsule", {Kind::capsule, {"height", "radiusBottom", "radiusTop"}}},
    {"cylinder", {Kind::cylinder, {"height", "radiusBottom", "radiusTop"}}},
    {"plane", {Kind::plane, {"sizeX", "sizeZ", "doubleSided"}}},
    {"convex", {Kind::mesh, {"mesh"}}},
    {"concave", {Kind::mesh, {"mesh"}}}};

/// Reads a capsule or cylinder.
void read_round_shape(const JsonValue& values, ImplicitShape& shape) {
  shape.height = shape.kind == Kind::capsule ? values.get("height", 0.5, &JsonValue::non_negative)
                                             : values.get("height", 0.5, &JsonValue::positive);
  shape.radius_bottom = values.get("radiusBottom", 0.25, &JsonValue::non_negative);
  shape.radius_top = values.get("radiusTop", 0.25, &JsonValue::non_negative);
  if (shape.radius_bottom == 0 && shape.radius_top == 0) values.fail("has radius 0 at both ends");
}

void read_values(const JsonValue& values, const GltfDocument& document, ImplicitShape& shape) {
  switch (shape.kind) {
    case Kind::sphere:
      shape.radius_bottom = shape.radius_top = values.get("radius", 0.5, &JsonValue::positive);
      return;
    case Kind::box:
      values.read("size", shape.size, &JsonValue::vector3);
      if (!(shape.size.minCoeff() > 0)) values.require("size").fail("must be three numbers greater than 0");
      return;
    case Kind::capsule:
    case Kind::cylinder:
      return read_round_shape(values, shape);
    case Kind::plane:
      values.read("sizeX", shape.plane_size[0], &JsonValue::positive);
      values.read("sizeZ", shape.plane_size[1], &JsonValue::positive);
      values.read("doubleSided", shape.double_sided, &JsonValue::boolean);
      return;
    case Kind::mesh:
      shape.mesh = document.index_of(values.require("mesh"), "meshes", "mesh");
  }
}

ImplicitShape read_shape(const JsonValue& json, const GltfDocument& document) {
  const std::string& name = json.require("type").text();
  const ShapeType type = json.require("type").one_of(shape_types);
  std::vector<std::string_view> keys{"type"};
  for (const auto& [other, unused] : shape_types) {
    keys.emplace_back(other);
    if (name != other && json.find(other)) {
      json.fail("is a {}, but also has '{}': a shape has the measures of its own type alone", name, other);
    }
  }
  json.warn_of_unknown(keys);
  ImplicitShape shape;
  shape.kind = type.kind;
  shape.convex_hull = name == "convex";
  static const Json none = Json::object();
  const auto given = json.find(name.c_str());
  const JsonValue values = given ? *given : json.with(none);
  values.warn_of_unknown(type.keys);
  read_values(values, document, shape);
  return shape;
}

ContactMaterial read_material(const JsonValue& json) {
  json.warn_of_unknown(
      {"staticFriction", "dynamicFriction", "restitution", "frictionCombine", "restitutionCombine"});
  ContactMaterial material;
  json.read("staticFriction", material.static_friction, &JsonValue::non_negative);
  json.read("dynamicFriction", material.dynamic_friction, &JsonValue::non_negative);
  json.read("restitution", material.restitution, &JsonValue::non_negative);
  if (material.restitution > 1) {
    json.require("restitution").fail("must be at most 1, but is {}", material.restitution);
  }
  const auto combine = [&](const char* key) {
    const auto value = json.find(key);
    if (!value) return Combine::unstated;
    return value->one_of<Combine>({{"average", Combine::average},
                                   {"minimum", Combine::minimum},
                                   {"maximum", Combine::maximum},
                                   {"multiply", Combine::multiply}});
  };
  material.friction_combine = combine("frictionCombine");
  material.restitution_combine = combine("restitutionCombine");
  return material;
}

/// Returns the bits of a list of collision systems, which any text names; each name gets a bit in the order
/// of first mention.
std::uint64_t system_bits(const JsonValue& list, std::vector<std::string>& names) {
  std::uint64_t bits = 0;
  for (const JsonValue& name : list.items()) {
    auto found = std::ranges::find(names, name.text());
    if (found == names.end()) {
      if (names.size() == 64)
        name.fail("the file names more than 64 collision systems, the most that are read");
      found = names.insert(found, name.text());
    }
    bits |= std::uint64_t{1} << (found - names.begin());
  }
  return bits;
}

CollisionFilter read_filter(const JsonValue& json, std::vector<std::string>& names) {
  json.warn_of_unknown({"collisionSystems", "collideWithSystems", "notCollideWithSystems"});
  CollisionFilter filter;
  const auto with = json.find("collideWithSystems");
  const auto without = json.find("notCollideWithSystems");
  if (with && without) json.fail("has both 'collideWithSystems' and 'notCollideWithSystems'; keep one");
  if (const auto member = json.find("collisionSystems")) filter.member = system_bits(*member, names);
  if (with) filter.collides_with = system_bits(*with, names);
  if (without) filter.collides_with = ~system_bits(*without, names);
  return filter;
}

/// The largest angle of a joint, rad: π, which files may round up.
constexpr double largest_angle = (1 + 1e-6) * std::numbers::pi;

/// Throws Error where no position meets the limit. Warns of ends and values without effect.
void check_limit(const JsonValue& json, const JointLimit& limit) {
  if (limit.min > limit.max) json.fail("has min {} above max {}", limit.min, limit.max);
  const bool is_signed = std::ranges::count(limit.axes, true) == 1;
  const double most = limit.angular ? largest_angle : infinity;
  if (limit.min > most || limit.max < (is_signed ? -most : 0)) {
    json.fail("no {} lies from {} to {}",
              !limit.angular ? "distance of 0 or more"
              : is_signed    ? "angle between -pi and pi"
                             : "angle between 0 and pi",
              limit.min, limit.max);
  }
  const auto is_beyond = [&](double end) { return end > most && end < infinity; };
  if (is_beyond(-limit.min) || is_beyond(limit.max)) json.warn("an end beyond pi has no effect");
  if (limit.min == -infinity && limit.max == infinity) json.warn("a limit without min and max has no effect");
  if (!limit.stiffness && limit.damping > 0) json.warn("damping has no effect without stiffness");
  if (limit.stiffness == 0 && limit.damping == 0) json.warn("stiffness 0 has no effect without damping");
}

JointLimit read_limit(const JsonValue& json) {
  json.warn_of_unknown({"linearAxes", "angularAxes", "min", "max", "stiffness", "damping"});
  JointLimit limit;
  const auto linear = json.find("linearAxes");
  const auto angular = json.find("angularAxes");
  if (linear.has_value() == angular.has_value()) json.fail("must have one of 'linearAxes' and 'angularAxes'");
  limit.angular = angular.has_value();
  const JsonValue axes = linear ? *linear : *angular;
  for (const JsonValue& axis : axes.items()) {
    const std::uint64_t index = axis.integer(2);
    if (limit.axes[index]) axis.fail("names axis {} again", index);
    limit.axes[index] = true;
  }
  if (axes.json().empty()) axes.fail("names no axis");
  json.read("min", limit.min, &JsonValue::number);
  json.read("max", limit.max, &JsonValue::number);
  json.read("stiffness", limit.stiffness, &JsonValue::non_negative);
  json.read("damping", limit.damping, &JsonValue::non_negative);
  check_limit(json, limit);
  return limit;
}

/// Returns false for a drive without stiffness and damping: it does nothing.
bool has_force(const JointDrive& drive) {
  return drive.stiffness + drive.damping > 0;
}

JointDrive read_drive(const JsonValue& json) {
  json.warn_of_unknown(
      {"type", "mode", "axis", "maxForce", "positionTarget", "velocityTarget", "stiffness", "damping"});
  JointDrive drive;
  drive.angular = json.require("type").one_of<bool>({{"linear", false}, {"angular", true}});
  drive.acceleration = json.require("mode").one_of<bool>({{"force", false}, {"acceleration", true}});
  drive.axis = static_cast<int>(json.require("axis").integer(2));
  json.read("maxForce", drive.max_force, &JsonValue::non_negative);
  json.read("positionTarget", drive.position_target, &JsonValue::number);
  json.read("velocityTarget", drive.velocity_target, &JsonValue::number);
  json.read("stiffness", drive.stiffness, &JsonValue::non_negative);
  json.read("damping", drive.damping, &JsonValue::non_negative);
  if (drive.position_target != 0 && drive.stiffness == 0) {
    json.warn("positionTarget has no effect without stiffness");
  } else if (drive.angular && std::abs(drive.position_target) > largest_angle) {
    json.require("positionTarget").fail("must lie between -pi and pi, but is {}", drive.position_target);
  }
  if (drive.velocity_target != 0 && drive.damping == 0) {
    json.warn("velocityTarget has no effect without damping");
  }
  if (!has_force(drive)) json.warn("a drive without stiffness and damping has no effect");
  return drive;
}

/// Returns the limits or drives. Throws Error above 100: every joint node has a copy of them.
std::vector<JsonValue> few_items(const JsonValue& json, const char* key) {
  constexpr std::size_t most = 100;
  std::vector<JsonValue> items = json.items(key);
  if (items.size() > most) {
    json.require(key).fail("has {} entries; the most that is read is {}", items.size(), most);
  }
  return items;
}

Joint read_joint(const JsonValue& json) {
  json.warn_of_unknown({"limits", "drives"});
  Joint joint;
  for (const JsonValue& limit : few_items(json, "limits")) joint.limits.push_back(read_limit(limit));
  for (const JsonValue& drive : few_items(json, "drives")) joint.drives.push_back(read_drive(drive));
  std::erase_if(joint.drives, [](const JointDrive& drive) { return !has_force(drive); });
  return joint;
}

MotionProperties read_motion(const JsonValue& json) {
  json.warn_of_unknown({"isKinematic", "mass", "centerOfMass", "inertiaDiagonal", "inertiaOrientation",
                        "linearVelocity", "angularVelocity", "gravityFactor"});
  MotionProperties motion;
  json.read("isKinematic", motion.kinematic, &JsonValue::boolean);
  json.read("mass", motion.mass, &JsonValue::non_negative);
  json.read("centerOfMass", motion.centre_of_mass, &JsonValue::vector3);
  json.read("inertiaDiagonal", motion.inertia_diagonal, &JsonValue::vector3);
  if (const auto& inertia = motion.inertia_diagonal) {
    const JsonValue given = json.require("inertiaDiagonal");
    if (inertia->minCoeff() < 0) given.fail("must not have a negative component");
    // A component 0 is infinite.
    if (inertia->minCoeff() > 0 && 2 * inertia->maxCoeff() > (1 + 1e-6) * inertia->sum()) {
      given.warn("one moment is above the sum of the two others, as no body has it: check the digits");
    }
  }
  json.read("inertiaOrientation", motion.inertia_orientation, &JsonValue::rotation);
  if (!motion.inertia_diagonal && !motion.inertia_orientation.vec().isZero(0)) {
    json.warn("inertiaOrientation has no effect without inertiaDiagonal");
  }
  json.read("linearVelocity", motion.linear_velocity, &JsonValue::vector3);
  json.read("angularVelocity", motion.angular_velocity, &JsonValue::vector3);
  json.read("gravityFactor", motion.gravity_factor, &JsonValue::number);
  return motion;
}

/// Reads a collider, or a trigger, which has the same keys but no material.
ColliderProperties read_collider(const JsonValue& json, const PhysicsTables& tables,
                                 const GltfDocument& document) {
  json.warn_of_unknown({"geometry", "physicsMaterial", "collisionFilter"});
  ColliderProperties collider;
  const JsonValue geometry = json.require("geometry");
  geometry.warn_of_unknown({"shape", "node", "mesh", "convexHull"});
  collider.shape = geometry.find_index("shape", tables.shapes.size(), "implicit shape");
  collider.node = geometry.find_index("node", document.size_of("nodes"), "node");
  collider.mesh = geometry.find_index("mesh", document.size_of("meshes"), "mesh");
  if ((collider.shape >= 0) + (collider.node >= 0) + (collider.mesh >= 0) != 1) {
    geometry.fail("must have one of 'shape', 'node' and 'mesh'");
  }
  geometry.read("convexHull", collider.convex_hull, &JsonValue::boolean);
  if (collider.shape >= 0 && collider.convex_hull) geometry.warn("convexHull has no effect beside 'shape'");
  if (collider.shape >= 0 && tables.shapes[collider.shape].kind == Kind::mesh) {
    collider.mesh = tables.shapes[collider.shape].mesh;
    collider.convex_hull = tables.shapes[collider.shape].convex_hull;
    collider.shape = -1;
  }
  collider.material = json.find_index("physicsMaterial", tables.materials.size(), "physics material");
  collider.filter = json.find_index("collisionFilter", tables.filters.size(), "collision filter");
  return collider;
}

}  // namespace

PhysicsTables read_physics_tables(const GltfDocument& document) {
  const JsonValue root = document.root();
  PhysicsTables tables;
  const auto bodies = root.extension(rigid_bodies);
  const auto shapes = root.extension("KHR_implicit_shapes");
  if (bodies) bodies->warn_of_unknown({"physicsMaterials", "collisionFilters", "physicsJoints"});
  if (shapes) shapes->warn_of_unknown({"shapes"});
  const auto root_shapes = root.find("shapes");
  if (shapes && root_shapes) root_shapes->warn("are ignored: the file has those of KHR_implicit_shapes too");
  for (const JsonValue& shape : (shapes ? *shapes : root).items("shapes")) {
    tables.shapes.push_back(read_shape(shape, document));
  }
  if (!bodies) return tables;
  for (const JsonValue& material : bodies->items("physicsMaterials")) {
    tables.materials.push_back(read_material(material));
  }
  std::vector<std::string> systems;
  for (const JsonValue& filter : bodies->items("collisionFilters")) {
    tables.filters.push_back(read_filter(filter, systems));
  }
  for (const JsonValue& joint : bodies->items("physicsJoints")) tables.joints.push_back(read_joint(joint));
  return tables;
}

NodePhysics read_node_physics(const GltfDocument& document, std::size_t node, const PhysicsTables& tables) {
  NodePhysics physics;
  const auto extension = document.item_of("nodes", node).extension(rigid_bodies);
  if (!extension) return physics;
  extension->warn_of_unknown({"motion", "collider", "trigger", "joint"});
  if (const auto motion = extension->find("motion")) physics.motion = read_motion(*motion);
  if (const auto collider = extension->find("collider")) {
    physics.collider = read_collider(*collider, tables, document);
  }
  if (const auto trigger = extension->find("trigger")) {
    if (trigger->find("nodes")) {
      for (const JsonValue& part : trigger->items("nodes")) document.index_of(part, "nodes", "node");
    } else {
      read_collider(*trigger, tables, document);
    }
    document.item_of("nodes", node).warn("a trigger is ignored: it moves nothing");
  }
  physics.has_joint = extension->find("joint").has_value();
  return physics;
}

}  // namespace substep
