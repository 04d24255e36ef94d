#include "render/animated_glb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <iterator>
#include <map>
#include <tuple>
#include <utility>

#include "render/body_mesh.h"
#include "render/camera.h"
#include "render/glb_writer.h"
#include "render/ground.h"
#include "sim/math/rotation.h"

namespace substep::render {
namespace {

using Json = GlbWriter::Json;

/// Attributes of vertices and how many numbers each has, in the order of Primitive::values.
constexpr std::array<std::pair<const char*, int>, 6> attributes{
    {{"POSITION", 3}, {"NORMAL", 3}, {"TEXCOORD_0", 2}, {"TEXCOORD_1", 2}, {"COLOR_0", 4}, {"TANGENT", 4}}};
enum Attribute : std::size_t { position, normal, coordinates, other_coordinates, color, tangent };

/// Triangles of one material, with the vertex attributes that its textures need.
struct Primitive {
  int material = 0;
  std::array<std::vector<float>, attributes.size()> values;  ///< by Attribute
  std::vector<std::uint32_t> indices;

  auto operator<=>(const Primitive&) const = default;
};

/// The meshes of bodies in the file; bodies with equal ones share a mesh.
class BodyMeshes {
 public:
  BodyMeshes(GlbWriter& writer, const Scene& scene)
      : writer_(writer), scene_(scene), mesh_(gather_body_mesh(scene)) {}

  const std::vector<Part>& parts() const { return mesh_.parts; }

  /// Adds a mesh unless an equal one is stored. Returns its index, −1 without primitives.
  int add(const std::vector<Primitive>& primitives) {
    if (primitives.empty()) return -1;
    const auto [known, is_new] = known_.try_emplace(primitives, 0);
    if (!is_new) return known->second;
    Json list = Json::array();
    for (const Primitive& primitive : primitives) {
      Json accessors;
      for (std::size_t i = 0; i < attributes.size(); ++i) {
        const auto& [name, width] = attributes[i];
        if (primitive.values[i].empty()) continue;
        accessors[name] = writer_.add_floats(primitive.values[i], width, i == position, true);
      }
      list.push_back({{"attributes", std::move(accessors)},
                      {"indices", writer_.add_indices(primitive.indices)},
                      {"material", primitive.material}});
    }
    known->second = writer_.add("meshes", {{"primitives", std::move(list)}});
    return known->second;
  }

  /// Adds a material of one colour and finish unless an equal one is stored. Returns its index.
  int add_plain(const Vertex& vertex) {
    Surface surface;
    std::ranges::copy(vertex.color, surface.base_color.begin());
    surface.metallic = vertex.metallic;
    surface.roughness = vertex.roughness;
    return writer_.add_material(surface, scene_);
  }

  /// Returns the primitives of a body: with looks one for each part, else one for each colour and finish.
  std::vector<Primitive> primitives_of(std::size_t body) {
    std::vector<Primitive> list;
    std::map<std::tuple<std::array<float, 3>, float, float>, Primitive> plain;
    for (std::size_t i = 0; i < mesh_.parts.size(); ++i) {
      const Part& part = mesh_.parts[i];
      if (part.body != static_cast<int>(body) || part.begin == part.end) continue;
      const auto begin = mesh_.indices.begin();
      if (!mesh_.looks.empty()) {
        Primitive& primitive = list.emplace_back();
        primitive.material = writer_.add_material(mesh_.surfaces[i], scene_);
        primitive.indices.assign(begin + part.begin, begin + part.end);
        take_vertices(primitive);
        remove_unused_values(primitive, mesh_.surfaces[i]);
        continue;
      }
      const Vertex& vertex = mesh_.vertices[mesh_.indices[part.begin]];
      Primitive& primitive = plain[{vertex.color, vertex.metallic, vertex.roughness}];
      primitive.material = add_plain(vertex);
      primitive.indices.insert(primitive.indices.end(), begin + part.begin, begin + part.end);
    }
    for (auto& [key, primitive] : plain) take_vertices(list.emplace_back(std::move(primitive)));
    return list;
  }

 private:
  void add_vertex(std::uint32_t index, Primitive& primitive) const {
    const auto append = [&](Attribute attribute, auto begin) {
      std::copy_n(begin, attributes[attribute].second, std::back_inserter(primitive.values[attribute]));
    };
    const Vertex& vertex = mesh_.vertices[index];
    append(position, vertex.position.begin());
    const Vector3 given(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
    const Eigen::Vector3f unit =
        (given.norm() > 1e-6 ? Vector3(given.normalized()) : Vector3(Vector3::UnitY())).cast<float>();
    append(normal, unit.begin());
    if (mesh_.looks.empty()) return;
    const LookVertex& look = mesh_.looks[index];
    append(coordinates, look.coordinates.begin());
    append(other_coordinates, look.coordinates.begin() + 2);
    append(color, look.color.begin());
    append(tangent, look.tangent.begin());
  }

  /// Copies the vertices of a primitive whose indices are the gathered mesh's, and numbers them anew.
  void take_vertices(Primitive& primitive) const {
    std::map<std::uint32_t, std::uint32_t> renumbered;
    for (std::uint32_t& index : primitive.indices) {
      const auto next = static_cast<std::uint32_t>(renumbered.size());
      const auto [entry, is_new] = renumbered.try_emplace(index, next);
      if (is_new) add_vertex(index, primitive);
      index = entry->second;
    }
  }

  /// Removes the vertex attributes that the surface does not need.
  static void remove_unused_values(Primitive& primitive, const Surface& surface) {
    auto& values = primitive.values;
    for (int set = 0; set < 2; ++set) {
      const bool is_used = std::ranges::any_of(surface.textures, [&](const Texture& texture) {
        return texture.image >= 0 && texture.coordinates == set;
      });
      if (!is_used) values[coordinates + set].clear();
    }
    // glTF requires the first set with the second.
    if (values[coordinates].empty()) values[coordinates] = values[other_coordinates];
    if (std::ranges::all_of(values[color], [](float level) { return level == 1; })) values[color].clear();
    bool has_tangents = surface.textures[Surface::normal_texture].image >= 0;
    for (std::size_t i = 3; i < values[tangent].size(); i += 4)
      has_tangents = has_tangents && values[tangent][i] != 0;
    if (!has_tangents) values[tangent].clear();
  }

  GlbWriter& writer_;
  const Scene& scene_;
  BodyMesh mesh_;
  std::map<std::vector<Primitive>, int> known_;
};

Json node_at(const std::string& name, const Vector3& translation, const Quaternion& orientation) {
  const Quaternion q = orientation.normalized();
  return {{"name", name},
          {"translation", {translation.x(), translation.y(), translation.z()}},
          {"rotation", {q.x(), q.y(), q.z(), q.w()}}};
}

void add_ground(GlbWriter& writer, const Scene& scene, BodyMeshes& meshes) {
  constexpr float reach = 50;
  Primitive square;
  square.values[position] = {-reach, 0, -reach, -reach, 0, reach, reach, 0, reach, reach, 0, -reach};
  square.values[normal] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
  square.indices = {0, 1, 2, 0, 2, 3};
  square.material = meshes.add_plain({{}, {}, {0.46F, 0.415F, 0.36F}, 0, 0.95F});
  const double height = ground_height(scene, meshes.parts());
  writer.add("nodes", {{"name", "ground"}, {"mesh", meshes.add({square})}, {"translation", {0, height, 0}}});
}

/// Returns the renderer's automatic camera for a picture of 16:9.
Camera automatic_camera(std::span<const Part> parts, std::span<const std::vector<Coordinates>> frames) {
  const View view = automatic_view(parts, frames, 16.0 / 9);
  Matrix3 axes;
  axes << to_eigen(view.right), to_eigen(view.up), -to_eigen(view.forward);
  Camera camera;
  camera.pose = {to_eigen(view.eye), Quaternion(axes).normalized()};
  camera.vertical_field_of_view = 2 * std::atan(view.tangent_y);
  return camera;
}

void add_camera(GlbWriter& writer, const Camera& camera) {
  writer.root()["cameras"] = Json::array(
      {{{"type", "perspective"},
        {"perspective", {{"yfov", camera.vertical_field_of_view}, {"znear", 0.01}, {"zfar", 1000}}}}});
  Json node = node_at("camera", camera.pose.position, camera.pose.orientation);
  node["camera"] = 0;
  writer.add("nodes", std::move(node));
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
  // Rotate from −Z, along which lights look.
  const Quaternion rotation = shortest_rotation(-Vector3::UnitZ(), light.direction.normalized());
  Json node = node_at(name, light.position, rotation);
  node["extensions"]["KHR_lights_punctual"]["light"] = lights.size() - 1;
  if (light.kind == Light::Kind::point) node.erase("rotation");
  writer.add("nodes", std::move(node));
}

/// Adds the scene's sun and lights; the default sun only where the scene has no light.
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

/// Returns true where all poses are finite and single precision can hold them.
bool can_be_keyed(const std::vector<Coordinates>& poses) {
  return std::ranges::all_of(poses, [](const Coordinates& q) {
    return q.linear.allFinite() && q.linear.cwiseAbs().maxCoeff() < 1e30 && q.angular.coeffs().allFinite();
  });
}

/// Adds channels for a body's position and orientation, each only if it changes.
void add_channels(GlbWriter& writer, std::span<const std::vector<Coordinates>> frames, std::size_t body,
                  int times, Json& animation) {
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
        {{"sampler", animation["samplers"].size() - 1}, {"target", {{"node", 1 + body}, {"path", path}}}});
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
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    Json node = {{"name", "world"}};
    if (body > 0) node = node_at(scene.bodies[body].name, start[body].linear, start[body].angular);
    const int mesh = meshes.add(meshes.primitives_of(body));
    if (mesh >= 0) node["mesh"] = mesh;
    writer.add("nodes", std::move(node));
  }
  const std::vector<std::vector<Coordinates>> at_start{start};
  const auto shown = frames.empty() ? std::span(at_start) : frames;
  add_camera(writer, scene.camera ? *scene.camera : automatic_camera(meshes.parts(), shown));
  add_lights(writer, scene);

  if (frames.size() > 1) {
    std::vector<float> times;
    for (std::size_t k = 0; k < frames.size(); ++k)
      times.push_back(static_cast<float>(static_cast<double>(k) * interval));
    const int keys = writer.add_floats(times, 1, true, false);
    Json animation = {{"name", scene.name}, {"samplers", Json::array()}, {"channels", Json::array()}};
    for (std::size_t body = 1; body < scene.bodies.size(); ++body)
      add_channels(writer, frames, body, keys, animation);
    if (!animation["channels"].empty()) writer.root()["animations"] = Json::array({animation});
  }
  return writer.bytes();
}

}  // namespace substep::render
