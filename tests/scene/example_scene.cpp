#include "tests/scene/example_scene.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <sstream>

#include "sim/error.h"
#include "sim/execution/child_process.h"
#include "sim/math/base64.h"
#include "sim/measure/json.h"
#include "tests/error_message.h"

namespace substep::test {
namespace {

void append(std::string& bytes, std::uint64_t value, int size) {
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \n");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \n") + 1 - begin);
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(trimmed(part));
  return parts;
}

}  // namespace

std::string pointer(std::string text) {
  for (const auto& [mark, name] : {std::pair{"/$", "/extensions/KHR_physics_rigid_bodies"},
                                   std::pair{"/#", "/extensions/KHR_implicit_shapes/shapes"}}) {
    const std::size_t at = text.find(mark);
    if (at != std::string::npos) text.replace(at, 2, name);
  }
  return text;
}

Json edited(Json document, const std::string& edits) {
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = std::min(edits.find(";\n", begin), edits.find("; /", begin));
    const std::string edit = edits.substr(begin, end - begin);
    const std::size_t sign = edit.find('=');
    const Json::json_pointer place(pointer(trimmed(edit.substr(0, sign))));
    const std::string value = trimmed(edit.substr(sign + 1));
    if (value.empty()) {
      document.at(place.parent_pointer()).erase(place.back());
    } else {
      document[place] = Json::parse(value);
    }
  }
  return document;
}

Json edited(const std::string& edits) {
  return edited(example(), edits);
}

std::vector<std::vector<std::string>> rows(const std::string& table) {
  std::vector<std::vector<std::string>> rows;
  std::string row;
  for (const std::string& line : split(table, '\n')) {
    row += line + (line.ends_with(';') ? "\n" : "");
    if (row.empty() || line.ends_with('|') || line.ends_with(';') || line.ends_with(',')) continue;
    rows.push_back(split(row, '|'));
    row.clear();
  }
  return rows;
}

std::string cube_buffer() {
  std::string bytes;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis)
      append(bytes, std::bit_cast<std::uint32_t>(corner >> axis & 1 ? 0.5f : -0.5f), 4);
  }
  for (const int index : {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                          2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6}) {
    append(bytes, static_cast<std::uint64_t>(index), 2);
  }
  return bytes;
}

Json example() {
  Json document = Json::parse(R"({
    "asset": {"version": "2.0"},
    "extensionsUsed": ["KHR_physics_rigid_bodies", "KHR_implicit_shapes", "KHR_lights_punctual"],
    "extensionsRequired": ["KHR_physics_rigid_bodies", "KHR_implicit_shapes"],
    "extensions": {
      "KHR_implicit_shapes": {"shapes": [{"type": "plane"}, {"type": "box", "box": {"size": [1, 1, 1]}}]},
      "KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3, "color": [1, 0.9, 0.8]}]},
      "KHR_physics_rigid_bodies": {
        "physicsMaterials": [{"staticFriction": 0.5, "dynamicFriction": 0.4, "restitution": 0.3,
                              "frictionCombine": "minimum"}],
        "collisionFilters": [{"collisionSystems": ["a", "b"], "notCollideWithSystems": ["b", "c"]}],
        "physicsJoints": [{"limits": [{"linearAxes": [0, 1, 2], "min": 0, "max": 0}],
                           "drives": [{"type": "angular", "mode": "force", "axis": 2, "maxForce": 5,
                                       "velocityTarget": 2, "damping": 10}]}]
      }
    },
    "buffers": [{"byteLength": 168}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    "materials": [{"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1],
                                                            "metallicFactor": 0, "roughnessFactor": 0.75}}],
    "meshes": [{"name": "cube", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
    "scene": 0,
    "scenes": [{"nodes": [0, 1, 3, 4, 6, 7]}],
    "nodes": [
      {"name": "ground", "extensions": {"KHR_physics_rigid_bodies": {"collider": {"geometry": {"shape": 0}}}}},
      {"name": "crate", "mesh": 0, "translation": [0, 2, 0], "children": [2],
       "extensions": {"KHR_physics_rigid_bodies": {
         "motion": {"mass": 2, "linearVelocity": [1, 0, 0]},
         "collider": {"geometry": {"shape": 1}, "physicsMaterial": 0, "collisionFilter": 0}}}},
      {"name": "hook", "translation": [0, 0.5, 0],
       "extensions": {"KHR_physics_rigid_bodies": {"joint": {"connectedNode": 3, "joint": 0}}}},
      {"name": "nail", "translation": [0, 2.5, 0]},
      {"name": "rock", "translation": [3, 1, 0], "scale": [2, 1, 1],
       "extensions": {"KHR_physics_rigid_bodies": {
         "motion": {}, "collider": {"geometry": {"node": 5, "convexHull": true}}}}},
      {"name": "rock shape", "mesh": 0, "translation": [100, 0, 0]},
      {"name": "eye", "camera": 0, "translation": [0, 1, 8]},
      {"name": "sun", "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476],
       "extensions": {"KHR_lights_punctual": {"light": 0}}}
    ]
  })");
  document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(cube_buffer());
  return document;
}

Json one_body(const std::string& motion, const std::string& shape) {
  Json document = Json::parse(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "body", "extensions": {"KHR_physics_rigid_bodies": {
      "collider": {"geometry": {"shape": 0}}}}}]})");
  document["nodes"][0]["extensions"]["KHR_physics_rigid_bodies"]["motion"] = Json::parse(motion);
  document["extensions"]["KHR_implicit_shapes"]["shapes"] = Json::array({Json::parse(shape)});
  return document;
}

std::string glb(const std::string& text, const std::string& binary) {
  std::string padded = text;
  padded.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file = "glTF";
  append(file, 2, 4);
  append(file, 12 + 8 + padded.size() + 8 + binary.size(), 4);
  append(file, padded.size(), 4);
  file += "JSON" + padded;
  append(file, binary.size(), 4);
  return file + std::string("BIN\0", 4) + binary;
}

Scene load(const Json& document) {
  const TemporaryFolder folder;
  return load_scene(folder.write("example.gltf", document.dump()));
}

void expect_scene(const Scene& scene, const std::string& table) {
  const Json actual = scene_json(scene);
  for (const auto& row : rows(table)) {
    SCOPED_TRACE(row[0]);
    const double tolerance = row.size() > 2 ? std::stod(row[2]) : 0;
    const Json found = actual.at(Json::json_pointer(row[0])).flatten();
    const Json expected = Json::parse(row[1]).flatten();
    EXPECT_EQ(found.size(), expected.size());
    for (const auto& [key, value] : expected.items()) {
      if (value.is_number()) {
        EXPECT_NEAR(found.at(key).get<double>(), value.get<double>(), tolerance) << key;
      } else {
        EXPECT_EQ(found.at(key), value) << key;
      }
    }
  }
}

std::string complaint(const std::filesystem::path& file) {
  return message_of([&] { load_scene(file); });
}

std::string complaint(const Json& document) {
  const TemporaryFolder folder;
  return complaint(folder.write("example.gltf", document.dump()));
}

std::string warnings(const Json& document) {
  std::string text;
  for (const std::string& warning : load(document).warnings) text += warning + '\n';
  return text;
}

int add_accessor(Json& document, std::string& bytes, const std::string& numbers, int component,
                 const char* type) {
  document["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", numbers.size()}});
  document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                   {"componentType", component},
                                   {"count", 8},
                                   {"type", type}});
  bytes += numbers;
  document["buffers"][0] = {{"byteLength", bytes.size()},
                            {"uri", "data:application/octet-stream;base64," + base64(bytes)}};
  return static_cast<int>(document["accessors"].size()) - 1;
}

Json skinned(Json document, int node, const std::string& joints) {
  std::string bytes = cube_buffer();
  std::string holders;
  std::string weights;
  for (int corner = 0; corner < 8; ++corner) {
    holders += std::string(1, static_cast<char>(corner / 4)) + std::string(3, '\0');
    weights += std::string("\xff\0\0\0", 4);
  }
  Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = add_accessor(document, bytes, holders, 5121, "VEC4");
  attributes["WEIGHTS_0"] = add_accessor(document, bytes, weights, 5121, "VEC4");
  document["accessors"].back()["normalized"] = true;
  document["skins"] = {{{"joints", Json::parse(joints)}}};
  document["nodes"][node]["skin"] = 0;
  return document;
}

Outcome outcome_of(const std::filesystem::path& file, const std::optional<MeshOptions>& options) {
  const TemporaryFile sent;
  const pid_t child = fork();
  if (child == 0) {
    const std::string message = message_of([&] {
      for (const Body& body : load_scene(file, options).bodies) {
        if (!body.pose.position.allFinite() || !body.inverse_inertia.allFinite()) throw Error("not finite");
      }
    });
    const auto size = static_cast<ssize_t>(message.size());
    _exit(write(sent.descriptor(), message.data(), message.size()) == size ? 0 : 3);
  }
  int status = 0;
  rusage used{};
  EXPECT_EQ(wait4(child, &status, 0, &used), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "it ended with status " << status;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {sent.content(), static_cast<double>(used.ru_maxrss) / 1024,
          seconds(used.ru_utime) + seconds(used.ru_stime)};
}

}  // namespace substep::test
