#include "render/animated_glb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "render/body_mesh.h"
#include "render/ground.h"

namespace substep {
namespace {

using Json = nlohmann::json;

// glTF's numbers for what OpenGL calls so.
constexpr int type_float = 5126;
constexpr int type_unsigned_int = 5125;
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;

using SurfaceKey = std::tuple<std::array<float, 3>, float, float>;

class Writer {
 public:
  Writer() {
    root_["asset"] = {{"version", "2.0"}, {"generator", "substep"}};
    for (const char* const list : {"accessors", "bufferViews", "meshes", "materials", "nodes"}) {
      root_[list] = Json::array();
    }
  }

  Json& root() { return root_; }

  int add_node(Json node) {
    root_["nodes"].push_back(std::move(node));
    const int index = static_cast<int>(root_["nodes"].size()) - 1;
    roots_.push_back(index);
    return index;
  }

  int add_floats(const std::vector<float>& values, int width, bool has_range, int target) {
    static constexpr std::array types{"", "SCALAR", "", "VEC3", "VEC4"};
    Json accessor = {{"bufferView", add_view(values.data(), values.size() * sizeof(float), target)},
                     {"componentType", type_float},
                     {"count", values.size() / static_cast<std::size_t>(width)},
                     {"type", types.at(static_cast<std::size_t>(width))}};
    if (has_range) {
      std::vector<float> low(values.begin(), values.begin() + width);
      std::vector<float> high = low;
      for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t axis = i % static_cast<std::size_t>(width);
        low[axis] = std::min(low[axis], values[i]);
        high[axis] = std::max(high[axis], values[i]);
      }
      accessor["min"] = low;
      accessor["max"] = high;
    }
    return add_accessor(std::move(accessor));
  }

  int add_indices(const std::vector<std::uint32_t>& indices) {
    return add_accessor({{"bufferView", add_view(indices.data(), indices.size() * sizeof(std::uint32_t),
                                                 element_array_buffer)},
                         {"componentType", type_unsigned_int},
                         {"count", indices.size()},
                         {"type", "SCALAR"}});
  }

  /// The same index for equal surfaces.
  int material_of(const Vertex& vertex) {
    const SurfaceKey key{vertex.color, vertex.metallic, vertex.roughness};
    const auto [entry, is_new] = materials_.try_emplace(key, static_cast<int>(materials_.size()));
    if (is_new) {
      root_["materials"].push_back(
          {{"pbrMetallicRoughness",
            {{"baseColorFactor", {vertex.color[0], vertex.color[1], vertex.color[2], 1}},
             {"metallicFactor", vertex.metallic},
             {"roughnessFactor", vertex.roughness}}},
           {"doubleSided", true}});
    }
    return entry->second;
  }

  /// The same index for meshes of equal primitives.
  int add_mesh(const Json& primitives, const std::string& content) {
    const auto [entry, is_new] = meshes_.try_emplace(content, static_cast<int>(meshes_.size()));
    if (is_new) root_["meshes"].push_back({{"primitives", primitives}});
    return entry->second;
  }
  bool has_mesh(const std::string& content, int& index) const {
    const auto found = meshes_.find(content);
    if (found == meshes_.end()) return false;
    index = found->second;
    return true;
  }

  std::string bytes() {
    root_["scene"] = 0;
    root_["scenes"] = Json::array({{{"nodes", roots_}}});
    root_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    // Names that are not UTF-8 get a replacement character.
    std::string text = root_.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    append(file, std::uint32_t{2});
    append(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary_.size()));
    append(file, static_cast<std::uint32_t>(text.size()));
    file += "JSON" + text;
    append(file, static_cast<std::uint32_t>(binary_.size()));
    file += std::string("BIN\0", 4) + binary_;
    return file;
  }

 private:
  static void append(std::string& file, std::uint32_t value) {
    for (int i = 0; i < 4; ++i) file += static_cast<char>(value >> (8 * i) & 0xff);
  }

  int add_accessor(Json accessor) {
    root_["accessors"].push_back(std::move(accessor));
    return static_cast<int>(root_["accessors"].size()) - 1;
  }

  /// All is of four-byte numbers: views stay aligned. x86-64 keeps them as glTF does, the lowest byte first.
  int add_view(const void* data, std::size_t size, int target) {
    Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    binary_.append(static_cast<const char*>(data), size);
    root_["bufferViews"].push_back(std::move(view));
    return static_cast<int>(root_["bufferViews"].size()) - 1;
  }

  Json root_;
  std::string binary_;
  std::vector<int> roots_;
  std::map<SurfaceKey, int> materials_;
  std::map<std::string, int> meshes_;
};

/// Triangles of one surface.
struct Primitive {
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<std::uint32_t> indices;
  std::map<std::uint32_t, std::uint32_t> renumbered;
  Vertex surface{};
};

/// The mesh of what a body draws between two of the indices; −1 where it draws nothing.
int add_body_mesh(Writer& writer, const BodyMesh& mesh, std::size_t begin, std::size_t end) {
  std::map<SurfaceKey, Primitive> primitives;
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t index = mesh.indices[i];
    // A triangle is of one part, and a part of one surface.
    const Vertex& vertex = mesh.vertices[index];
    Primitive& primitive = primitives[{vertex.color, vertex.metallic, vertex.roughness}];
    primitive.surface = vertex;
    const auto [entry, is_new] =
        primitive.renumbered.try_emplace(index, static_cast<std::uint32_t>(primitive.renumbered.size()));
    if (is_new) {
      primitive.positions.insert(primitive.positions.end(), vertex.position.begin(), vertex.position.end());
      Vector3 normal(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
      normal = normal.norm() > 1e-6 ? normal.normalized() : Vector3::UnitY();
      for (int axis = 0; axis < 3; ++axis) primitive.normals.push_back(static_cast<float>(normal[axis]));
    }
    primitive.indices.push_back(entry->second);
  }
  if (primitives.empty()) return -1;
  std::string content;
  const auto add_bytes = [&content](const auto& values) {
    content.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  for (const auto& [key, primitive] : primitives) {
    content += std::to_string(writer.material_of(primitive.surface)) + ":";
    add_bytes(primitive.positions);
    add_bytes(primitive.normals);
    add_bytes(primitive.indices);
  }
  int known = -1;
  if (writer.has_mesh(content, known)) return known;
  Json list = Json::array();
  for (const auto& [key, primitive] : primitives) {
    list.push_back({{"attributes",
                     {{"POSITION", writer.add_floats(primitive.positions, 3, true, array_buffer)},
                      {"NORMAL", writer.add_floats(primitive.normals, 3, false, array_buffer)}}},
                    {"indices", writer.add_indices(primitive.indices)},
                    {"material", writer.material_of(primitive.surface)}});
  }
  return writer.add_mesh(list, content);
}

Json rotation_of(const Quaternion& q) {
  const Quaternion unit = q.normalized();
  return {unit.x(), unit.y(), unit.z(), unit.w()};
}

/// The rotation that takes −Z, along which cameras and lights look, to a direction.
Quaternion looking_along(const Vector3& direction) {
  return Quaternion::FromTwoVectors(-Vector3::UnitZ(), direction.normalized());
}

void add_ground(Writer& writer, const Scene& scene, std::span<const Part> parts) {
  constexpr float reach = 50;
  constexpr Vertex surface{{0, 0, 0}, {0, 1, 0}, {0.46F, 0.415F, 0.36F}, 0, 0.95F};
  const std::vector<float> positions{-reach, 0, -reach, -reach, 0, reach, reach, 0, reach, reach, 0, -reach};
  const std::vector<float> normals{0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
  const Json primitive = {{"attributes",
                           {{"POSITION", writer.add_floats(positions, 3, true, array_buffer)},
                            {"NORMAL", writer.add_floats(normals, 3, false, array_buffer)}}},
                          {"indices", writer.add_indices({0, 1, 2, 0, 2, 3})},
                          {"material", writer.material_of(surface)}};
  const int mesh = writer.add_mesh(Json::array({primitive}), "ground");
  writer.add_node({{"name", "ground"}, {"mesh", mesh}, {"translation", {0, ground_height(scene, parts), 0}}});
}

void add_camera_and_sun(Writer& writer, const Scene& scene) {
  if (scene.camera) {
    const Vector3& eye = scene.camera->pose.position;
    writer.root()["cameras"] =
        Json::array({{{"type", "perspective"},
                      {"perspective",
                       {{"yfov", scene.camera->vertical_field_of_view}, {"znear", 0.01}, {"zfar", 1000}}}}});
    writer.add_node({{"name", "camera"},
                     {"camera", 0},
                     {"translation", {eye.x(), eye.y(), eye.z()}},
                     {"rotation", rotation_of(scene.camera->pose.orientation)}});
  }
  const Sun sun = scene.sun.value_or(Sun{});
  if (!(sun.direction.norm() > 0)) return;
  writer.root()["extensionsUsed"] = {"KHR_lights_punctual"};
  writer.root()["extensions"]["KHR_lights_punctual"]["lights"] =
      Json::array({{{"type", "directional"}, {"color", sun.color}, {"intensity", sun.illuminance}}});
  writer.add_node({{"name", "sun"},
                   {"rotation", rotation_of(looking_along(sun.direction))},
                   {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
}

bool can_be_keyed(const std::vector<Coordinates>& poses) {
  return std::ranges::all_of(poses, [](const Coordinates& q) {
    return q.linear.allFinite() && q.linear.cwiseAbs().maxCoeff() < 1e30 && q.angular.coeffs().allFinite();
  });
}

/// A body's channels, where it moves.
void add_channels(Writer& writer, std::span<const std::vector<Coordinates>> frames, std::size_t body,
                  int node, int times, Json& animation) {
  std::vector<float> positions;
  std::vector<float> rotations;
  Eigen::Vector4d before = frames.front()[body].angular.coeffs();
  for (const std::vector<Coordinates>& frame : frames) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(frame[body].linear[axis]));
    Eigen::Vector4d turn = frame[body].angular.coeffs().normalized();
    // Of the two quaternions of a rotation the one near the last: viewers go from key to key.
    if (turn.dot(before) < 0) turn = -turn;
    before = turn;
    for (int axis = 0; axis < 4; ++axis) rotations.push_back(static_cast<float>(turn[axis]));
  }
  const auto add = [&](const std::vector<float>& values, int width, const char* path) {
    const auto step = static_cast<std::size_t>(width);
    bool moves = false;
    for (std::size_t i = step; i < values.size(); ++i) moves = moves || values[i] != values[i % step];
    if (!moves) return;
    animation["samplers"].push_back({{"input", times},
                                     {"output", writer.add_floats(values, width, false, 0)},
                                     {"interpolation", "LINEAR"}});
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  };
  add(positions, 3, "translation");
  add(rotations, 4, "rotation");
}

}  // namespace

std::string animated_glb(const Scene& scene, std::span<const std::vector<Coordinates>> frames,
                         double interval) {
  const auto bad = std::ranges::find_if_not(frames, can_be_keyed);
  frames = frames.first(static_cast<std::size_t>(bad - frames.begin()));
  const std::vector<Coordinates> start = frames.empty() ? initial_state(scene).q : frames.front();
  const BodyMesh mesh = gather_body_mesh(scene);
  Writer writer;
  add_ground(writer, scene, mesh.parts);
  std::vector<int> nodes;
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    Json node = {{"name", body == 0 ? "world" : scene.bodies[body].name}};
    const int drawn = add_body_mesh(writer, mesh, mesh.begin[body], mesh.begin[body + 1]);
    if (drawn >= 0) node["mesh"] = drawn;
    if (body > 0) {
      const Coordinates& q = start[body];
      node["translation"] = {q.linear.x(), q.linear.y(), q.linear.z()};
      node["rotation"] = rotation_of(q.angular);
    }
    nodes.push_back(writer.add_node(std::move(node)));
  }
  add_camera_and_sun(writer, scene);

  if (frames.size() > 1) {
    std::vector<float> times;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      times.push_back(static_cast<float>(static_cast<double>(k) * interval));
    }
    const int keys = writer.add_floats(times, 1, true, 0);
    Json animation = {{"name", scene.name}, {"samplers", Json::array()}, {"channels", Json::array()}};
    for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
      add_channels(writer, frames, body, nodes[body], keys, animation);
    }
    if (!animation["channels"].empty()) writer.root()["animations"] = Json::array({animation});
  }
  return writer.bytes();
}

}  // namespace substep
