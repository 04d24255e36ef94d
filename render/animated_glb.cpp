#include "render/animated_glb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/glb_materials.h"
#include "render/glb_writer.h"
#include "render/ground.h"

namespace substep::render {
namespace {

using Json = GlbWriter::Json;

/// Materials of bodies with one colour and finish.
using SurfaceKey = std::tuple<std::array<float, 3>, float, float>;

/// Triangles of one material, with the vertex attributes that its textures need.
struct Primitive {
  int material = 0;
  std::vector<float> positions;
  std::vector<float> normals;
  std::array<std::vector<float>, 2> coordinates;
  std::vector<float> colors;
  std::vector<float> tangents;
  std::vector<std::uint32_t> indices;
  std::map<std::uint32_t, std::uint32_t> renumbered;
};

/// The meshes of bodies in the file; bodies with equal ones share a mesh.
class BodyMeshes {
 public:
  BodyMeshes(GlbWriter& writer, const Scene& scene)
      : writer_(writer), materials_(writer, scene), mesh_(gather_body_mesh(scene)) {}

  const BodyMesh& gathered() const { return mesh_; }

  /// Returns the index of a body's mesh, −1 where it has none.
  int add(std::size_t body);

  int add_plain(const Vertex& vertex);

 private:
  void add_vertex(std::uint32_t index, Primitive& primitive) const;
  std::vector<Primitive> plain_primitives(std::size_t body);
  std::vector<Primitive> textured_primitives(std::size_t body);
  Json attributes_of(const Primitive& primitive);

  GlbWriter& writer_;
  GlbMaterials materials_;
  BodyMesh mesh_;
  std::map<SurfaceKey, int> plain_;
  std::map<std::string, int> known_;
};

int BodyMeshes::add_plain(const Vertex& vertex) {
  const auto [entry, is_new] = plain_.try_emplace({vertex.color, vertex.metallic, vertex.roughness}, 0);
  if (is_new) {
    Surface surface;
    std::ranges::copy(vertex.color, surface.base_color.begin());
    surface.metallic = vertex.metallic;
    surface.roughness = vertex.roughness;
    entry->second = materials_.add(surface);
  }
  return entry->second;
}

void BodyMeshes::add_vertex(std::uint32_t index, Primitive& primitive) const {
  const auto [entry, is_new] =
      primitive.renumbered.try_emplace(index, static_cast<std::uint32_t>(primitive.renumbered.size()));
  primitive.indices.push_back(entry->second);
  if (!is_new) return;
  const Vertex& vertex = mesh_.vertices[index];
  primitive.positions.insert(primitive.positions.end(), vertex.position.begin(), vertex.position.end());
  Vector3 normal(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
  normal = normal.norm() > 1e-6 ? normal.normalized() : Vector3::UnitY();
  for (int axis = 0; axis < 3; ++axis) primitive.normals.push_back(static_cast<float>(normal[axis]));
  if (mesh_.looks.empty()) return;
  const LookVertex& look = mesh_.looks[index];
  for (std::size_t set = 0; set < 2; ++set) {
    primitive.coordinates[set].insert(primitive.coordinates[set].end(), look.coordinates.begin() + 2 * set,
                                      look.coordinates.begin() + 2 * set + 2);
  }
  primitive.colors.insert(primitive.colors.end(), look.color.begin(), look.color.end());
  primitive.tangents.insert(primitive.tangents.end(), look.tangent.begin(), look.tangent.end());
}

std::vector<Primitive> BodyMeshes::plain_primitives(std::size_t body) {
  std::map<SurfaceKey, Primitive> primitives;
  for (std::size_t i = mesh_.begin[body]; i < mesh_.begin[body + 1]; ++i) {
    // A triangle is of one part, and a part of one surface.
    const Vertex& vertex = mesh_.vertices[mesh_.indices[i]];
    Primitive& primitive = primitives[{vertex.color, vertex.metallic, vertex.roughness}];
    if (primitive.indices.empty()) primitive.material = add_plain(vertex);
    add_vertex(mesh_.indices[i], primitive);
  }
  std::vector<Primitive> list;
  list.reserve(primitives.size());
  for (auto& [key, primitive] : primitives) list.push_back(std::move(primitive));
  return list;
}

/// Writes a primitive, with only those vertex attributes that its material needs.
std::vector<Primitive> BodyMeshes::textured_primitives(std::size_t body) {
  std::vector<Primitive> list;
  for (const Piece& piece : mesh_.pieces) {
    if (piece.body != body || piece.begin == piece.end) continue;
    const Surface& surface = mesh_.surfaces[piece.surface];
    Primitive& primitive = list.emplace_back();
    primitive.material = materials_.add(surface);
    for (std::size_t i = piece.begin; i < piece.end; ++i) add_vertex(mesh_.indices[i], primitive);
    for (int set = 0; set < 2; ++set) {
      const bool is_used = std::ranges::any_of(surface.textures, [&](const Texture& texture) {
        return texture.image >= 0 && texture.coordinates == set;
      });
      if (!is_used) primitive.coordinates[static_cast<std::size_t>(set)].clear();
    }
    // glTF wants the second set to come with the first.
    if (!primitive.coordinates[1].empty() && primitive.coordinates[0].empty()) {
      primitive.coordinates[0] = primitive.coordinates[1];
    }
    if (std::ranges::all_of(primitive.colors, [](float level) { return level == 1; }))
      primitive.colors.clear();
    bool has_tangents = surface.textures[Surface::normal_texture].image >= 0;
    for (std::size_t i = 3; i < primitive.tangents.size(); i += 4) {
      has_tangents = has_tangents && primitive.tangents[i] != 0;
    }
    if (!has_tangents) primitive.tangents.clear();
  }
  return list;
}

Json BodyMeshes::attributes_of(const Primitive& primitive) {
  Json attributes = {{"POSITION", writer_.add_floats(primitive.positions, 3, true, true)},
                     {"NORMAL", writer_.add_floats(primitive.normals, 3, false, true)}};
  const auto add = [&](const char* name, const std::vector<float>& values, int width) {
    if (!values.empty()) attributes[name] = writer_.add_floats(values, width, false, true);
  };
  add("TEXCOORD_0", primitive.coordinates[0], 2);
  add("TEXCOORD_1", primitive.coordinates[1], 2);
  add("COLOR_0", primitive.colors, 4);
  add("TANGENT", primitive.tangents, 4);
  return attributes;
}

int BodyMeshes::add(std::size_t body) {
  const std::vector<Primitive> primitives =
      mesh_.pieces.empty() ? plain_primitives(body) : textured_primitives(body);
  if (primitives.empty()) return -1;
  std::string content;
  const auto add_bytes = [&content](const auto& values) {
    content += std::to_string(values.size()) + ":";
    content.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  for (const Primitive& primitive : primitives) {
    content += std::to_string(primitive.material) + ":";
    for (const auto* values : {&primitive.positions, &primitive.normals, &primitive.coordinates[0],
                               &primitive.coordinates[1], &primitive.colors, &primitive.tangents}) {
      add_bytes(*values);
    }
    add_bytes(primitive.indices);
  }
  const auto [entry, is_new] =
      known_.try_emplace(std::move(content), static_cast<int>(writer_.root()["meshes"].size()));
  if (!is_new) return entry->second;
  Json list = Json::array();
  for (const Primitive& primitive : primitives) {
    list.push_back({{"attributes", attributes_of(primitive)},
                    {"indices", writer_.add_indices(primitive.indices)},
                    {"material", primitive.material}});
  }
  writer_.root()["meshes"].push_back({{"primitives", std::move(list)}});
  return entry->second;
}

Json rotation_of(const Quaternion& q) {
  const Quaternion unit = q.normalized();
  return {unit.x(), unit.y(), unit.z(), unit.w()};
}

/// Returns the rotation from −Z, along which cameras and lights look, to a direction.
Quaternion looking_along(const Vector3& direction) {
  return Quaternion::FromTwoVectors(-Vector3::UnitZ(), direction.normalized());
}

void add_ground(GlbWriter& writer, const Scene& scene, BodyMeshes& meshes) {
  constexpr float reach = 50;
  constexpr Vertex surface{{0, 0, 0}, {0, 1, 0}, {0.46F, 0.415F, 0.36F}, 0, 0.95F};
  const std::vector<float> positions{-reach, 0, -reach, -reach, 0, reach, reach, 0, reach, reach, 0, -reach};
  const std::vector<float> normals{0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
  const Json primitive = {{"attributes",
                           {{"POSITION", writer.add_floats(positions, 3, true, true)},
                            {"NORMAL", writer.add_floats(normals, 3, false, true)}}},
                          {"indices", writer.add_indices({0, 1, 2, 0, 2, 3})},
                          {"material", meshes.add_plain(surface)}};
  writer.root()["meshes"].push_back({{"primitives", Json::array({primitive})}});
  const double height = ground_height(scene, meshes.gathered().parts);
  writer.add_node(
      {{"name", "ground"}, {"mesh", writer.root()["meshes"].size() - 1}, {"translation", {0, height, 0}}});
}

/// Returns the renderer's camera for a scene without one, in a wide picture.
Camera automatic_camera(std::span<const Part> parts, std::span<const std::vector<Coordinates>> frames) {
  const View view = automatic_view(parts, frames, 16.0 / 9);
  const auto vector = [](const glm::dvec3& v) { return Vector3(v.x, v.y, v.z); };
  Matrix3 axes;
  axes << vector(view.right), vector(view.up), -vector(view.forward);
  Camera camera;
  camera.pose = {vector(view.eye), Quaternion(axes).normalized()};
  camera.vertical_field_of_view = 2 * std::atan(view.tangent_y);
  return camera;
}

void add_camera(GlbWriter& writer, const Camera& camera) {
  const Vector3& eye = camera.pose.position;
  writer.root()["cameras"] = Json::array(
      {{{"type", "perspective"},
        {"perspective", {{"yfov", camera.vertical_field_of_view}, {"znear", 0.01}, {"zfar", 1000}}}}});
  writer.add_node({{"name", "camera"},
                   {"camera", 0},
                   {"translation", {eye.x(), eye.y(), eye.z()}},
                   {"rotation", rotation_of(camera.pose.orientation)}});
}

void add_light(GlbWriter& writer, const char* name, const Light& light) {
  static constexpr std::array kinds{"directional", "point", "spot"};
  Json json = {{"type", kinds.at(static_cast<std::size_t>(light.kind))},
               {"color", light.color},
               {"intensity", light.intensity}};
  if (light.kind != Light::Kind::directional && std::isfinite(light.range)) json["range"] = light.range;
  if (light.kind == Light::Kind::spot) {
    json["spot"] = {{"innerConeAngle", light.inner_angle}, {"outerConeAngle", light.outer_angle}};
  }
  writer.use("KHR_lights_punctual");
  Json& lights = writer.root()["extensions"]["KHR_lights_punctual"]["lights"];
  lights.push_back(std::move(json));
  Json node = {{"name", name},
               {"translation", {light.position.x(), light.position.y(), light.position.z()}},
               {"extensions", {{"KHR_lights_punctual", {{"light", lights.size() - 1}}}}}};
  if (light.kind != Light::Kind::point) node["rotation"] = rotation_of(looking_along(light.direction));
  writer.add_node(std::move(node));
}

/// Adds the sun, but where the scene has other lights alone.
void add_lights(GlbWriter& writer, const Scene& scene) {
  const Sun sun = scene.sun.value_or(Sun{});
  if ((scene.sun || scene.lights.empty()) && sun.direction.norm() > 0) {
    add_light(writer, "sun",
              {.kind = Light::Kind::directional,
               .direction = sun.direction,
               .color = sun.color,
               .intensity = sun.illuminance});
  }
  for (const Light& light : scene.lights) add_light(writer, "light", light);
}

bool can_be_keyed(const std::vector<Coordinates>& poses) {
  return std::ranges::all_of(poses, [](const Coordinates& q) {
    return q.linear.allFinite() && q.linear.cwiseAbs().maxCoeff() < 1e30 && q.angular.coeffs().allFinite();
  });
}

/// Writes the animation channels of a body that moves.
void add_channels(GlbWriter& writer, std::span<const std::vector<Coordinates>> frames, std::size_t body,
                  int node, int times, Json& animation) {
  std::vector<float> positions;
  std::vector<float> rotations;
  Eigen::Vector4d before = frames.front()[body].angular.coeffs();
  for (const std::vector<Coordinates>& frame : frames) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(frame[body].linear[axis]));
    Eigen::Vector4d turn = frame[body].angular.coeffs().normalized();
    // Take the quaternion nearer to the last one, since viewers interpolate between keys.
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
                                     {"output", writer.add_floats(values, width, false, false)},
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
  GlbWriter writer;
  BodyMeshes meshes(writer, scene);
  add_ground(writer, scene, meshes);
  std::vector<int> nodes;
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    Json node = {{"name", body == 0 ? "world" : scene.bodies[body].name}};
    const int drawn = meshes.add(body);
    if (drawn >= 0) node["mesh"] = drawn;
    if (body > 0) {
      const Coordinates& q = start[body];
      node["translation"] = {q.linear.x(), q.linear.y(), q.linear.z()};
      node["rotation"] = rotation_of(q.angular);
    }
    nodes.push_back(writer.add_node(std::move(node)));
  }
  const std::vector<std::vector<Coordinates>> at_start{start};
  const auto shown = frames.empty() ? std::span(at_start) : frames;
  add_camera(writer, scene.camera ? *scene.camera : automatic_camera(meshes.gathered().parts, shown));
  add_lights(writer, scene);

  if (frames.size() > 1) {
    std::vector<float> times;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      times.push_back(static_cast<float>(static_cast<double>(k) * interval));
    }
    const int keys = writer.add_floats(times, 1, true, false);
    Json animation = {{"name", scene.name}, {"samplers", Json::array()}, {"channels", Json::array()}};
    for (std::size_t body = 1; body < scene.bodies.size(); ++body) {
      add_channels(writer, frames, body, nodes[body], keys, animation);
    }
    if (!animation["channels"].empty()) writer.root()["animations"] = Json::array({animation});
  }
  return writer.bytes();
}

}  // namespace substep::render
