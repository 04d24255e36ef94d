#include "sim/loading/scene_appearance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>

#include "sim/loading/scene_textures.h"

namespace substep {
namespace {

/// Each is computed at every pixel.
constexpr std::size_t most_lights = 16;

double unit_interval(const JsonValue& object, const char* key) {
  const double value = get(object, key, 1.0, &JsonValue::number);
  if (!(value >= 0 && value <= 1)) {
    object.require(key).fail(fmt::format("must lie between 0 and 1, but is {}", value));
  }
  return value;
}

std::array<double, 3> color_in(const JsonValue& color) {
  const Vector3 rgb = color.vector3();
  if (rgb.minCoeff() < 0) color.fail("must not have a negative component");
  return {rgb.x(), rgb.y(), rgb.z()};
}

void read_metal(const JsonValue& properties, TextureReader& textures, Surface& surface) {
  if (const auto color = properties.find("baseColorFactor")) {
    const std::vector<JsonValue> channels = color->items();
    if (channels.size() != 4) color->fail("must be an array of 4 numbers");
    for (int i = 0; i < 3; ++i) surface.base_color[i] = channels[i].non_negative();
    surface.alpha = std::clamp(channels[3].non_negative(), 0.0, 1.0);
  }
  surface.metallic = unit_interval(properties, "metallicFactor");
  surface.roughness = unit_interval(properties, "roughnessFactor");
  surface.textures[Surface::color_texture] = textures.read(properties, "baseColorTexture");
  surface.textures[Surface::finish_texture] = textures.read(properties, "metallicRoughnessTexture");
}

void read_opacity(const JsonValue& material, Surface& surface) {
  const auto mode = material.find("alphaMode");
  if (!mode || mode->text() == "OPAQUE") return;
  if (mode->text() == "MASK") {
    surface.opacity = Surface::Opacity::cut;
    surface.cut_off = get(material, "alphaCutoff", surface.cut_off, &JsonValue::non_negative);
  } else if (mode->text() == "BLEND") {
    surface.opacity = Surface::Opacity::blended;
  } else {
    mode->fail("must be OPAQUE, MASK or BLEND");
  }
}

Surface read_surface(const JsonValue& material, std::size_t index, TextureReader& textures) {
  Surface surface;
  surface.name = material.name(fmt::format("material {}", index));
  surface.base_color = {1, 1, 1};
  surface.metallic = 1;
  surface.roughness = 1;
  if (const auto properties = material.find("pbrMetallicRoughness")) {
    read_metal(*properties, textures, surface);
  }
  read_opacity(material, surface);
  surface.has_back = get(material, "doubleSided", false, &JsonValue::boolean);
  surface.is_unlit = material.extension("KHR_materials_unlit").has_value();
  surface.textures[Surface::normal_texture] = textures.read(material, "normalTexture");
  if (const auto normal = material.find("normalTexture")) {
    surface.normal_scale = get(*normal, "scale", 1.0, &JsonValue::number);
  }
  surface.textures[Surface::occlusion_texture] = textures.read(material, "occlusionTexture");
  if (const auto occlusion = material.find("occlusionTexture")) {
    surface.occlusion_strength = unit_interval(*occlusion, "strength");
  }
  surface.textures[Surface::emission_texture] = textures.read(material, "emissiveTexture");
  if (const auto emission = material.find("emissiveFactor")) {
    surface.emission = color_in(*emission);
    const auto extension = material.extension("KHR_materials_emissive_strength");
    const double strength =
        extension ? get(*extension, "emissiveStrength", 1.0, &JsonValue::non_negative) : 1.0;
    for (double& level : surface.emission) level *= strength;
  }
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
// for that; a file with daylight's tens of thousands means a camera that is stopped down, so its sun gets the
// same 3, and its other lights as much less.
void expose(Scene& scene) {
  constexpr double brightest_without_exposure = 30;
  constexpr double exposed = 3;
  if (!scene.sun || !(scene.sun->illuminance > brightest_without_exposure)) return;
  for (Light& light : scene.lights) light.intensity *= exposed / scene.sun->illuminance;
  scene.sun->illuminance = exposed;
}

Sun read_sun(const JsonValue& light, const GltfNode& node, const JsonValue& reference) {
  Sun sun;
  sun.direction = facing_pose(node.world, reference).orientation * Vector3(0, 0, -1);
  if (const auto color = light.find("color")) sun.color = color_in(*color);
  sun.illuminance = get(light, "intensity", 1.0, &JsonValue::non_negative);
  return sun;
}

Light read_light(const JsonValue& json, const GltfNode& node, const JsonValue& reference) {
  Light light;
  const std::string& type = json.require("type").text();
  if (type == "directional") {
    light.kind = Light::Kind::directional;
  } else if (type == "spot") {
    light.kind = Light::Kind::spot;
  } else if (type != "point") {
    json.require("type").fail("must be directional, point or spot");
  }
  light.position = node.world.translation;
  if (light.kind != Light::Kind::point) {
    light.direction = facing_pose(node.world, reference).orientation * Vector3(0, 0, -1);
  }
  if (const auto color = json.find("color")) light.color = color_in(*color);
  light.intensity = get(json, "intensity", 1.0, &JsonValue::non_negative);
  if (json.find("range")) light.range = get(json, "range", 0.0, &JsonValue::positive);
  if (light.kind == Light::Kind::spot) {
    const auto cone = json.find("spot");
    const double widest = std::numbers::pi / 2;
    light.inner_angle = cone ? get(*cone, "innerConeAngle", 0.0, &JsonValue::non_negative) : 0;
    light.outer_angle = cone ? get(*cone, "outerConeAngle", widest / 2, &JsonValue::positive) : widest / 2;
    if (!(light.inner_angle < light.outer_angle && light.outer_angle <= widest)) {
      cone->fail("its angles must be 0 <= innerConeAngle < outerConeAngle <= pi / 2");
    }
  }
  return light;
}

/// Of a node that holds a light.
void add_light(const JsonValue& json, const GltfNode& node, const JsonValue& reference, Scene& scene) {
  if (json.require("type").text() == "directional" && !scene.sun) {
    scene.sun = read_sun(json, node, reference);
    return;
  }
  if (scene.lights.size() == most_lights) {
    scene.warnings.push_back(fmt::format("{}: more than {} lights beside the sun: it is not drawn",
                                         reference.path(), most_lights));
    return;
  }
  scene.lights.push_back(read_light(json, node, reference));
}

}  // namespace

std::vector<Surface> read_surfaces(GltfDocument& document, std::vector<SceneImage>& images,
                                   std::vector<std::string>& warnings) {
  std::vector<Surface> surfaces;
  TextureReader textures(document, images, warnings);
  for (std::size_t i = 0; i < document.size_of("materials"); ++i) {
    surfaces.push_back(read_surface(document.item_of("materials", static_cast<int>(i)), i, textures));
  }
  surfaces.emplace_back().name = "no material";
  return surfaces;
}

VertexLooks looks_of(const VertexLooks& looks, std::span<const std::uint32_t> vertices) {
  const auto chosen = [&](const auto& all) {
    std::remove_cvref_t<decltype(all)> some;
    some.reserve(all.empty() ? 0 : vertices.size());
    for (std::size_t i = 0; !all.empty() && i < vertices.size(); ++i) some.push_back(all[vertices[i]]);
    return some;
  };
  return {{chosen(looks.texture_coordinates[0]), chosen(looks.texture_coordinates[1])},
          chosen(looks.colors),
          chosen(looks.tangents)};
}

Mesh drawn_mesh(std::vector<Vector3> positions, std::vector<Vector3> normals, std::vector<Triangle> triangles,
                const std::string& name, int surface, VertexLooks looks) {
  Mesh mesh;
  mesh.name = name;
  mesh.surface = surface;
  if (!normals.empty()) {
    mesh.positions = std::move(positions);
    mesh.normals = std::move(normals);
    mesh.triangles = std::move(triangles);
    mesh.looks = std::move(looks);
    return mesh;
  }
  std::vector<std::uint32_t> corners;
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
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  }
  mesh.looks = looks_of(looks, corners);
  mesh.looks.tangents.clear();  // they were square to normals that are not there
  return mesh;
}

void read_cameras_and_lights(const GltfDocument& document, Scene& scene) {
  const auto punctual = document.root().extension("KHR_lights_punctual");
  const std::vector<JsonValue> lights =
      punctual ? punctual->require("lights").items() : std::vector<JsonValue>{};
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const GltfNode& node = document.nodes[i];
    if (!node.in_scene) continue;
    const JsonValue json = document.node_json(static_cast<int>(i));
    if (const auto camera = json.find("camera")) {
      const int index = camera->index(document.size_of("cameras"), "camera");
      const JsonValue item = document.item_of("cameras", index);
      if (item.find("perspective")) {
        scene.cameras.push_back({node.name, item.name(""), read_camera(document, *camera, node)});
      } else {
        scene.warnings.push_back(camera->path() + ": only perspective cameras are drawn with; it is ignored");
      }
    }
    if (const auto extension = json.extension("KHR_lights_punctual")) {
      const JsonValue reference = extension->require("light");
      add_light(lights[reference.index(lights.size(), "light")], node, reference, scene);
    }
  }
  expose(scene);
  if (!scene.cameras.empty()) scene.camera = scene.cameras.front().view;
}

}  // namespace substep
