#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/needed_substeps.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"

namespace substep {
namespace {

using nlohmann::json;

struct InfoOptions {
  SceneOptions scene;
  bool as_json = false;
};

json numbers(const Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

/// A number, or null where it is infinite, which JSON cannot say.
json finite(double value) {
  return std::isfinite(value) ? json(value) : json();
}

json reciprocal(double value) {
  return value == 0 ? json() : json(1 / value);
}

json of_shape(const Sphere& sphere) {
  return {{"shape", "sphere"}, {"radius", sphere.radius}};
}
json of_shape(const Capsule& capsule) {
  return {{"shape", "capsule"}, {"radius", capsule.radius}, {"height", 2 * capsule.half_length}};
}
json of_shape(const Plane& /*plane*/) {
  return {{"shape", "plane"}};
}
json of_shape(const Polytope& polytope) {
  if (polytope.box) return {{"shape", "box"}, {"size", numbers(2 * polytope.box->half_size)}};
  if (polytope.ellipsoid) {
    return {{"shape", "ellipsoid"},
            {"halfAxes", numbers(*polytope.ellipsoid)},
            {"vertices", polytope.vertices.size()}};
  }
  return {{"shape", "hull"}, {"vertices", polytope.vertices.size()}, {"faces", polytope.face_count()}};
}
json of_shape(const Cylinder& cylinder) {
  return {{"shape", "cylinder"},
          {"height", 2 * cylinder.half_height},
          {"radiusBottom", cylinder.radius_bottom},
          {"radiusTop", cylinder.radius_top}};
}
json of_shape(const TaperedCapsule& capsule) {
  return {{"shape", "tapered capsule"},
          {"height", 2 * capsule.half_length},
          {"radiusBottom", capsule.radius_bottom},
          {"radiusTop", capsule.radius_top}};
}
json of_shape(const TriangleMesh& mesh) {
  return {{"shape", "triangle mesh"}, {"triangles", mesh.triangles.size()}, {"twoSided", mesh.two_sided}};
}

const char* combine_name(Combine combine) {
  switch (combine) {
    case Combine::average:
      return "average";
    case Combine::minimum:
      return "minimum";
    case Combine::maximum:
      return "maximum";
    case Combine::multiply:
      break;
  }
  return "multiply";
}

json of_collider(const Collider& collider) {
  json result = std::visit([](const auto& shape) { return of_shape(shape); }, collider.shape);
  const ContactMaterial& material = collider.material;
  result["material"] = {{"staticFriction", material.static_friction},
                        {"dynamicFriction", material.dynamic_friction},
                        {"restitution", material.restitution},
                        {"frictionCombine", combine_name(material.friction_combine)},
                        {"restitutionCombine", combine_name(material.restitution_combine)}};
  return result;
}

std::string axes_of(const JointLimit& limit) {
  std::string axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (limit.axes[static_cast<std::size_t>(axis)]) axes += "xyz"[axis];
  }
  return axes;
}

json of_joint(const Scene& scene, const Joint& joint) {
  const auto body = [&](int index) { return scene.bodies[static_cast<std::size_t>(index)].name; };
  json result{{"name", joint.name},
              {"bodies", {body(joint.body_a), body(joint.body_b)}},
              {"bodiesCollide", joint.enable_collision},
              {"limits", json::array()},
              {"drives", json::array()}};
  for (const JointLimit& limit : joint.limits) {
    result["limits"].push_back({{"type", limit.angular ? "angular" : "linear"},
                                {"axes", axes_of(limit)},
                                {"min", finite(limit.min)},
                                {"max", finite(limit.max)},
                                {"stiffness", limit.stiffness ? json(*limit.stiffness) : json()},
                                {"damping", limit.damping}});
  }
  for (const JointDrive& drive : joint.drives) {
    result["drives"].push_back({{"type", drive.angular ? "angular" : "linear"},
                                {"axis", std::string(1, "xyz"[drive.axis])},
                                {"mode", drive.acceleration ? "acceleration" : "force"},
                                {"maxForce", finite(drive.max_force)},
                                {"positionTarget", drive.position_target},
                                {"velocityTarget", drive.velocity_target},
                                {"stiffness", drive.stiffness},
                                {"damping", drive.damping}});
  }
  return result;
}

const char* kind_of(const Body& body) {
  if (body.inverse_mass > 0) return "dynamic";
  return body.inverse_inertia.isZero(0) ? "kinematic" : "pivoting";
}

/// Why n is not that of most scenes; empty where it is.
std::string reason_of_substeps(const Scene& scene) {
  if (scene.substeps != needed_substeps(scene)) return "as its file says";
  if (scene.substeps == default_settings(Algorithm::a5).substeps) return "";
  return fmt::format("as its heaviest body is {:.4g} times as heavy as its lightest", mass_ratio(scene));
}

/// All that the scene holds, as it will be simulated.
json describe(const Scene& scene) {
  json result{{"scene", scene.name},
              {"file", scene.file.string()},
              {"hash", fmt::format("{:016x}", scene.hash)},
              {"gravity", numbers(scene.gravity)},
              {"duration", scene.duration},
              {"step", scene.step},
              {"bodies", json::array()},
              {"joints", json::array()},
              {"warnings", scene.warnings}};
  const Settings settings = usual_settings(scene, Algorithm::a5);
  result["default"] = label(settings);
  result["substeps"] = {{"count", scene.substeps}, {"reason", reason_of_substeps(scene)}};
  result["parts"] = Simulation(scene, usual_settings(scene, Algorithm::a1)).equal_parts();
  result["modelled"] = Simulation(scene, settings).modelled();
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    json entry{{"name", body.name}, {"colliders", json::array()}};
    if (i > 0) {
      entry["kind"] = kind_of(body);
      entry["mass"] = reciprocal(body.inverse_mass);
      entry["inertia"] = {reciprocal(body.inverse_inertia.x()), reciprocal(body.inverse_inertia.y()),
                          reciprocal(body.inverse_inertia.z())};
      entry["position"] = numbers(body.pose.position);
      entry["linearVelocity"] = numbers(body.linear_velocity);
      entry["angularVelocity"] = numbers(body.angular_velocity);
      entry["gravityFactor"] = body.gravity_factor;
    }
    for (const Collider& collider : scene.colliders) {
      if (collider.body == static_cast<int>(i)) entry["colliders"].push_back(of_collider(collider));
    }
    result["bodies"].push_back(std::move(entry));
  }
  for (const Joint& joint : scene.joints) result["joints"].push_back(of_joint(scene, joint));
  std::size_t triangles = 0;
  for (const Visual& visual : scene.visuals) {
    triangles += scene.meshes[static_cast<std::size_t>(visual.mesh)].triangles.size();
  }
  result["drawn"] = {{"meshes", scene.visuals.size()}, {"triangles", triangles}};
  result["camera"] = scene.camera ? json{{"position", numbers(scene.camera->pose.position)},
                                         {"verticalFieldOfView", scene.camera->vertical_field_of_view}}
                                  : json();
  return result;
}

std::string number(const json& value) {
  return value.is_null() ? "∞" : fmt::format("{:.4g}", value.get<double>());
}

std::string counted(std::size_t count, const char* one, const char* several) {
  return fmt::format("{} {}", count, count == 1 ? one : several);
}

std::string triple(const json& values) {
  return fmt::format("{} {} {}", number(values[0]), number(values[1]), number(values[2]));
}

std::string collider_line(const json& collider) {
  const auto measure = [&](const char* key) { return number(collider.at(key)); };
  const std::string shape = collider.at("shape");
  std::string text = shape;
  if (shape == "sphere") {
    text += fmt::format(", radius {} m", measure("radius"));
  } else if (shape == "capsule") {
    text += fmt::format(", radius {} m, {} m between its centres", measure("radius"), measure("height"));
  } else if (shape == "box") {
    text += fmt::format(", {} m", triple(collider.at("size")));
  } else if (shape == "ellipsoid") {
    text += fmt::format(", half axes {} m; to others than planes a hull of {} vertices",
                        triple(collider.at("halfAxes")), collider.at("vertices").dump());
  } else if (shape == "hull") {
    text +=
        fmt::format(", {} vertices, {} faces", collider.at("vertices").dump(), collider.at("faces").dump());
  } else if (shape == "triangle mesh") {
    text += fmt::format(", {} triangles{}", collider.at("triangles").dump(),
                        collider.at("twoSided").get<bool>() ? ", both sides" : "");
  } else if (shape != "plane") {
    text += fmt::format(", radii {} and {} m, height {} m", measure("radiusBottom"), measure("radiusTop"),
                        measure("height"));
  }
  const json& material = collider.at("material");
  return fmt::format("{}; friction {} / {} ({}), restitution {} ({})", text,
                     number(material.at("staticFriction")), number(material.at("dynamicFriction")),
                     material.at("frictionCombine").get<std::string>(), number(material.at("restitution")),
                     material.at("restitutionCombine").get<std::string>());
}

void print_colliders(const json& body) {
  // Compounds often repeat one shape: counted in the order of their first.
  std::vector<std::pair<std::string, int>> lines;
  for (const json& collider : body.at("colliders")) {
    const std::string line = collider_line(collider);
    if (!lines.empty() && lines.back().first == line) {
      ++lines.back().second;
    } else {
      lines.emplace_back(line, 1);
    }
  }
  for (const auto& [line, count] : lines) {
    fmt::print("    {}{}\n", count > 1 ? fmt::format("{} × ", count) : "", line);
  }
}

std::string range(const json& limit) {
  const char* unit = limit.at("type") == "angular" ? "rad" : "m";
  const std::string low = limit.at("min").is_null() ? "−∞" : number(limit.at("min"));
  std::string text = limit.at("min") == limit.at("max") && !limit.at("min").is_null()
                         ? fmt::format("held at {} {}", low, unit)
                         : fmt::format("from {} to {} {}", low, number(limit.at("max")), unit);
  if (!limit.at("stiffness").is_null()) {
    text += fmt::format(", soft: stiffness {}, damping {}", number(limit.at("stiffness")),
                        number(limit.at("damping")));
  }
  return text;
}

void print_joint(const json& joint) {
  fmt::print("  {}: {} – {}{}\n", joint.at("name").get<std::string>(),
             joint.at("bodies")[0].get<std::string>(), joint.at("bodies")[1].get<std::string>(),
             joint.at("bodiesCollide").get<bool>() ? ", which also collide" : "");
  for (const json& limit : joint.at("limits")) {
    fmt::print("    {} {}: {}\n", limit.at("type").get<std::string>(), limit.at("axes").get<std::string>(),
               range(limit));
  }
  for (const json& drive : joint.at("drives")) {
    fmt::print("    drive, {} {}: to {} with stiffness {}, at {} with damping {}, at most {} ({})\n",
               drive.at("type").get<std::string>(), drive.at("axis").get<std::string>(),
               number(drive.at("positionTarget")), number(drive.at("stiffness")),
               number(drive.at("velocityTarget")), number(drive.at("damping")), number(drive.at("maxForce")),
               drive.at("mode").get<std::string>());
  }
}

void print(const json& scene) {
  const json& drawn = scene.at("drawn");
  fmt::print("{}: {}, {}, {} drawn ({})\n", scene.at("scene").get<std::string>(),
             counted(scene.at("bodies").size() - 1, "body", "bodies"),
             counted(scene.at("joints").size(), "joint", "joints"),
             counted(drawn.at("meshes"), "mesh", "meshes"),
             counted(drawn.at("triangles"), "triangle", "triangles"));
  fmt::print("gravity {} m/s², {} s in steps of {} s\n", triple(scene.at("gravity")),
             number(scene.at("duration")), number(scene.at("step")));
  fmt::print("modelled: {}\n", scene.at("modelled").get<std::string>());
  const std::string reason = scene.at("substeps").at("reason");
  fmt::print("by default: {}{}{}\n", scene.at("default").get<std::string>(), reason.empty() ? "" : "; n ",
             reason);
  if (const int parts = scene.at("parts"); parts > 1) {
    fmt::print("A1 and A2 take each step in {} parts: {}\n", parts, reason_of_parts);
  }
  if (scene.at("camera").is_null()) {
    fmt::print("camera: none, so it is fitted to the motion\n");
  } else {
    fmt::print("camera: at {} m, {} rad high\n", triple(scene.at("camera").at("position")),
               number(scene.at("camera").at("verticalFieldOfView")));
  }
  fmt::print("\nbodies:\n");
  for (const json& body : scene.at("bodies")) {
    if (!body.contains("mass")) {
      if (body.at("colliders").empty()) continue;
      fmt::print("  {}\n", body.at("name").get<std::string>());
    } else {
      fmt::print("  {}: {}, {} kg, inertia {} kg m², at {} m\n", body.at("name").get<std::string>(),
                 body.at("kind").get<std::string>(), number(body.at("mass")), triple(body.at("inertia")),
                 triple(body.at("position")));
      const double factor = body.at("gravityFactor");
      if (factor != 1) fmt::print("    gravity × {:.4g}\n", factor);
    }
    print_colliders(body);
  }
  if (!scene.at("joints").empty()) fmt::print("\njoints:\n");
  for (const json& joint : scene.at("joints")) print_joint(joint);
  if (scene.at("warnings").empty()) return;
  fmt::print("\nreplaced or left out:\n");
  for (const json& warning : scene.at("warnings")) fmt::print("  {}\n", warning.get<std::string>());
}

void show(const InfoOptions& options) {
  const json description = describe(load_scene(options.scene.file, options.scene.mesh_options()));
  if (options.as_json) {
    // Names come from files, in any coding.
    fmt::print("{}\n", description.dump(1, ' ', false, json::error_handler_t::replace));
  } else {
    print(description);
  }
}

}  // namespace

void add_info_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("info", "Say what a scene contains, what of it is modelled and what is not");
  const auto options = std::make_shared<InfoOptions>();
  options->scene.add_to(*command);
  command->add_flag("--json", options->as_json, "As JSON: SI units, null for infinite");
  command->footer("Example:\n  substep info scenes/joint_kinds.gltf");
  command->callback([options] { show(*options); });
}

}  // namespace substep
