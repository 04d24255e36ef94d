#include "sim/loading/scene_appearance.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace substep {
namespace {

double unit_interval(const JsonValue& object, const char* key) {
  const double value = get(object, key, 1.0, &JsonValue::number);
  if (!(value >= 0 && value <= 1)) {
    object.require(key).fail(fmt::format("must lie between 0 and 1, but is {}", value));
  }
  return value;
}

Surface read_surface(const JsonValue& material, std::size_t index, bool& textured) {
  Surface surface;
  surface.name = material.name(fmt::format("material {}", index));
  surface.base_color = {1, 1, 1};
  surface.metallic = 1;
  surface.roughness = 1;
  const auto properties = material.find("pbrMetallicRoughness");
  if (!properties) return surface;
  if (const auto color = properties->find("baseColorFactor")) {
    const std::vector<JsonValue> channels = color->items();
    if (channels.size() != 4) color->fail("must be an array of 4 numbers");
    for (int i = 0; i < 3; ++i) surface.base_color[i] = channels[i].non_negative();
  }
  surface.metallic = unit_interval(*properties, "metallicFactor");
  surface.roughness = unit_interval(*properties, "roughnessFactor");
  textured = textured || properties->find("baseColorTexture") || properties->find("metallicRoughnessTexture");
  return surface;
}

// The pose of what looks or shines along a node's −Z; a scale or shear of the node has no meaning for it.
Pose facing_pose(const NodeTransform& world, const JsonValue& node) {
  if (!world.sheared) return world.rigid();
  Matrix3 axes;
  axes.col(2) = world.linear.col(2).normalized();
  axes.col(0) = world.linear.col(1).cross(axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  if (!(std::fabs(axes.determinant()) > 0.5)) node.fail("its transform loses the direction it faces");
  return {world.translation, Quaternion(axes).normalized()};
}

Camera read_camera(const GltfDocument& document, const JsonValue& reference, const GltfNode& node) {
  const int index = reference.index(document.size_of("cameras"), "camera");
  const JsonValue perspective = document.item_of("cameras", index).require("perspective");
  Camera camera;
  camera.vertical_field_of_view = perspective.require("yfov").positive();
  if (!(camera.vertical_field_of_view < std::numbers::pi))
    perspective.require("yfov").fail("must be less than pi");
  camera.pose = facing_pose(node.world, reference);
  return camera;
}

// glTF gives lux. Files made without an exposure in mind have about 3, and the renderer's exposure is made
// for that; a file with daylight's tens of thousands means a camera that is stopped down, so it gets the
// same 3.
double illuminance_for_drawing(double lux) {
  constexpr double brightest_without_exposure = 30;
  return lux > brightest_without_exposure ? 3 : lux;
}

Sun read_sun(const JsonValue& light, const GltfNode& node, const JsonValue& reference) {
  Sun sun;
  sun.direction = facing_pose(node.world, reference).orientation * Vector3(0, 0, -1);
  if (const auto color = light.find("color")) {
    const Vector3 rgb = color->vector3();
    if (rgb.minCoeff() < 0) color->fail("must not have a negative component");
    sun.color = {rgb.x(), rgb.y(), rgb.z()};
  }
  sun.illuminance = illuminance_for_drawing(get(light, "intensity", 1.0, &JsonValue::non_negative));
  return sun;
}

}  // namespace

std::vector<Surface> read_surfaces(const GltfDocument& document, std::vector<std::string>& warnings) {
  std::vector<Surface> surfaces;
  bool textured = false;
  for (std::size_t i = 0; i < document.size_of("materials"); ++i) {
    surfaces.push_back(read_surface(document.item_of("materials", static_cast<int>(i)), i, textured));
  }
  if (textured) warnings.emplace_back("textures are not drawn: each material is drawn in its factors");
  surfaces.emplace_back().name = "no material";
  return surfaces;
}

Mesh drawn_mesh(std::vector<Vector3> positions, std::vector<Vector3> normals, std::vector<Triangle> triangles,
                const std::string& name, int surface) {
  Mesh mesh;
  mesh.name = name;
  mesh.surface = surface;
  if (!normals.empty()) {
    mesh.positions = std::move(positions);
    mesh.normals = std::move(normals);
    mesh.triangles = std::move(triangles);
    return mesh;
  }
  for (const Triangle& triangle : triangles) {
    const Vector3& a = positions[triangle[0]];
    const Vector3& b = positions[triangle[1]];
    const Vector3& c = positions[triangle[2]];
    const Vector3 normal = (b - a).cross(c - a).stableNormalized();
    if (!(normal.squaredNorm() > 0.5)) continue;  // no area, so nothing to see
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.normals.insert(mesh.normals.end(), 3, normal);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

void read_camera_and_sun(const GltfDocument& document, Scene& scene) {
  const auto punctual = document.root().extension("KHR_lights_punctual");
  const std::vector<JsonValue> lights =
      punctual ? punctual->require("lights").items() : std::vector<JsonValue>{};
  bool others = false;
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const GltfNode& node = document.nodes[i];
    if (!node.in_scene) continue;
    const JsonValue json = document.node_json(static_cast<int>(i));
    if (const auto camera = json.find("camera"); camera && !scene.camera) {
      const int index = camera->index(document.size_of("cameras"), "camera");
      if (document.item_of("cameras", index).find("perspective")) {
        scene.camera = read_camera(document, *camera, node);
      } else {
        scene.warnings.push_back(camera->path() + ": only perspective cameras are drawn with; it is ignored");
      }
    }
    if (const auto extension = json.extension("KHR_lights_punctual")) {
      const JsonValue reference = extension->require("light");
      const JsonValue& light = lights[reference.index(lights.size(), "light")];
      if (light.require("type").text() == "directional" && !scene.sun) {
        scene.sun = read_sun(light, node, reference);
      } else {
        others = true;
      }
    }
  }
  if (others)
    scene.warnings.emplace_back("only the first directional light is drawn; the others are ignored");
}

}  // namespace substep
