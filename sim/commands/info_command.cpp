#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/loading/json_value.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/json.h"
#include "sim/simulation.h"

namespace substep {
namespace {

struct InfoOptions {
  SceneOptions scene;
  bool as_json = false;
};

std::string number(const Json& value) {
  return value.is_null() ? "∞" : fmt::format("{:.4g}", value.get<double>());
}

std::string counted(std::size_t count, const char* one, const char* several) {
  return fmt::format("{} {}", count, count == 1 ? one : several);
}

std::string triple(const Json& values) {
  return fmt::format("{} {} {}", number(values[0]), number(values[1]), number(values[2]));
}

std::string collider_line(const Json& collider) {
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
  const Json& material = collider.at("material");
  // Print "not stated" where the other material chooses the mode.
  const auto mode = [&](const char* key) {
    return material.at(key).is_null() ? std::string("not stated") : material.at(key).get<std::string>();
  };
  return fmt::format("{}; friction {} / {} ({}), restitution {} ({})", text,
                     number(material.at("staticFriction")), number(material.at("dynamicFriction")),
                     mode("frictionCombine"), number(material.at("restitution")), mode("restitutionCombine"));
}

void print_colliders(const Json& body) {
  // Count equal successive colliders, since compounds often repeat one shape.
  std::vector<std::pair<std::string, int>> lines;
  for (const Json& collider : body.at("colliders")) {
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

std::string range(const Json& limit) {
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

void print_joint(const Json& joint) {
  fmt::print("  {}: {} – {}{}\n", joint.at("name").get<std::string>(),
             joint.at("bodies")[0].get<std::string>(), joint.at("bodies")[1].get<std::string>(),
             joint.at("bodiesCollide").get<bool>() ? ", which also collide" : "");
  for (const Json& limit : joint.at("limits")) {
    fmt::print("    {} {}: {}\n", limit.at("type").get<std::string>(), limit.at("axes").get<std::string>(),
               range(limit));
  }
  for (const Json& drive : joint.at("drives")) {
    fmt::print("    drive, {} {}: to {} with stiffness {}, at {} with damping {}, at most {} ({})\n",
               drive.at("type").get<std::string>(), drive.at("axis").get<std::string>(),
               number(drive.at("positionTarget")), number(drive.at("stiffness")),
               number(drive.at("velocityTarget")), number(drive.at("damping")), number(drive.at("maxForce")),
               drive.at("mode").get<std::string>());
  }
}

void print(const Json& scene) {
  const Json& drawn = scene.at("drawn");
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
  if (const std::string doubt = scene.at("substeps").at("doubt"); !doubt.empty())
    fmt::print("may not hold: {}\n", doubt);
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
  for (const Json& body : scene.at("bodies")) {
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
  for (const Json& joint : scene.at("joints")) print_joint(joint);
  if (scene.at("warnings").empty()) return;
  fmt::print("\nreplaced or left out:\n");
  for (const Json& warning : scene.at("warnings")) fmt::print("  {}\n", warning.get<std::string>());
}

void show(const InfoOptions& options) {
  const Json description = scene_json(load_scene(options.scene.file, options.scene.mesh_options()));
  if (options.as_json) {
    // Replace invalid UTF-8, since names come from files in any encoding.
    fmt::print("{}\n", description.dump(1, ' ', false, Json::error_handler_t::replace));
  } else {
    print(description);
  }
}

}  // namespace

void add_info_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("info", "Print a scene's contents, and which of them are modelled");
  const auto options = std::make_shared<InfoOptions>();
  options->scene.add_to(*command);
  command->add_flag("--json", options->as_json, "As JSON: SI units, null for infinite");
  command->footer("Example:\n  substep info scenes/joint_kinds.gltf");
  command->callback([options] { show(*options); });
}

}  // namespace substep
