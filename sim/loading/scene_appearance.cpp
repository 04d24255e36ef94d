#include "sim/loading/scene_appearance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <utility>

#include "sim/math/rotation.h"

namespace substep {
namespace {

double unit_interval(const JsonValue& object, const char* key) {
  const double value = object.get(key, 1.0, &JsonValue::number);
  if (!(value >= 0 && value <= 1)) object.require(key).fail("must lie between 0 and 1, but is {}", value);
  return value;
}

void read_color(const JsonValue& object, const char* key, std::array<double, 3>& color) {
  const auto given = object.find(key);
  if (!given) return;
  const Vector3 rgb = given->vector3();
  if (rgb.minCoeff() < 0) given->fail("must not have a negative component");
  color = {rgb.x(), rgb.y(), rgb.z()};
}

void read_pair(const JsonValue& object, const char* key, Eigen::Ref<Eigen::Vector2d> pair) {
  if (const auto given = object.find(key)) pair = Eigen::Vector2d(given->numbers(2).data());
}

void read_coordinates(const JsonValue& object, int& coordinates) {
  const auto given = object.find("texCoord");
  if (!given) return;
  coordinates = static_cast<int>(given->integer(0xffff));
  if (coordinates > 1)
    given->fail("is {}, but only the sets 0 and 1 of texture coordinates are read", coordinates);
}

/// Reads KHR_texture_transform, which scales, then rotates, then moves coordinates.
void read_transform(const JsonValue& transform, Texture& texture) {
  Eigen::Vector2d scale(1, 1);
  read_pair(transform, "scale", scale);
  const SineCosine of = sine_cosine(transform.get("rotation", 0.0, &JsonValue::number));
  texture.uv_matrix << of.cosine * scale.x(), of.sine * scale.y(), -of.sine * scale.x(),
      of.cosine * scale.y();
  read_pair(transform, "offset", texture.offset);
  read_coordinates(transform, texture.coordinates);
}

Texture::Wrap wrap_in(const JsonValue& sampler, const char* key) {
  const auto given = sampler.find(key);
  switch (given ? given->integer(0xffff) : 10497) {
    case 10497:
      return Texture::Wrap::repeat;
    case 33648:
      return Texture::Wrap::mirrored;
    case 33071:
      return Texture::Wrap::clamped;
    default:
      given->fail("must be 10497 (repeat), 33648 (mirrored) or 33071 (clamped)");
  }
}

void read_sampler(const JsonValue& sampler, Texture& texture) {
  texture.wrap = {wrap_in(sampler, "wrapS"), wrap_in(sampler, "wrapT")};
  constexpr std::uint64_t nearest = 9728;
  constexpr std::uint64_t linear = 9729;
  // NEAREST_MIPMAP_NEAREST; LINEAR_MIPMAP_NEAREST, NEAREST_MIPMAP_LINEAR and LINEAR_MIPMAP_LINEAR follow.
  constexpr std::uint64_t nearest_of_nearest = 9984;
  if (const auto near = sampler.find("magFilter")) {
    const std::uint64_t value = near->integer(0xffff);
    if (value != nearest && value != linear) near->fail("must be 9728 (nearest) or 9729 (linear)");
    texture.is_sharp_near = value == nearest;
  }
  if (const auto far = sampler.find("minFilter")) {
    const std::uint64_t value = far->integer(0xffff);
    if (value == nearest || value == linear) {
      texture.levels = Texture::Levels::none;
    } else if (value >= nearest_of_nearest && value <= nearest_of_nearest + 3) {
      texture.levels = value >= nearest_of_nearest + 2 ? Texture::Levels::blended : Texture::Levels::nearest;
    } else {
      far->fail("must be 9728, 9729 or from 9984 to 9987, the filters of OpenGL");
    }
    texture.is_sharp_far = value % 2 == 0;
  }
}

/// Reads each image that materials need, once and without decoding it.
class TextureReader {
 public:
  TextureReader(GltfDocument& document, std::vector<SceneImage>& images)
      : document_(document), images_(images) {}

  /// Returns the texture that `key` of `object` names; none where it has no such key. Warns of an image that
  /// is not there or neither PNG nor JPEG, and leaves it out. Throws Error for bad indices or sizes.
  Texture read(const JsonValue& object, const char* key) {
    Texture texture;
    const auto info = object.find(key);
    if (!info) return texture;
    const JsonValue json = document_.target_of(info->require("index"), "textures", "texture");
    read_coordinates(*info, texture.coordinates);
    if (const auto transform = info->extension("KHR_texture_transform")) read_transform(*transform, texture);
    if (const auto sampler = json.find("sampler")) {
      read_sampler(document_.target_of(*sampler, "samplers", "sampler"), texture);
    }
    if (const auto source = json.find("source")) {
      texture.image = image(document_.index_of(*source, "images", "image"));
    } else {
      json.warn("has no image that is read: surfaces are drawn without it");
    }
    return texture;
  }

 private:
  /// Returns the index of an image of the document among the scene's; −1 where it is left out.
  int image(int index) {
    const auto [place, is_new] = read_.try_emplace(index, -1);
    if (!is_new) return place->second;
    const JsonValue json = document_.item_of("images", index);
    std::shared_ptr<const std::string> bytes;  // shared with document_.files, but for a buffer's
    if (const auto uri = json.find("uri")) {
      bytes = read_uri(*uri, document_);
      if (!bytes) uri->warn("there is no such file: surfaces are drawn without it");
      if (!bytes) return -1;
    } else {
      bytes = std::make_shared<const std::string>(buffer_view(document_, json.require("bufferView")));
    }
    if (!bytes->starts_with("\x89PNG\r\n\x1a\n") && !bytes->starts_with("\xff\xd8\xff")) {
      json.warn("is neither PNG nor JPEG: surfaces are drawn without it");
      return -1;
    }
    // Many images may share bytes of a buffer, so that a small file can need much memory.
    constexpr std::uint64_t most = std::uint64_t{1} << 28;
    size_ += bytes->size();
    if (size_ > most) json.fail("with it the images have more than {} bytes together", most);
    place->second = static_cast<int>(images_.size());
    images_.push_back({json.place(), std::move(bytes)});
    return place->second;
  }

  GltfDocument& document_;
  std::vector<SceneImage>& images_;
  std::uint64_t size_ = 0;   ///< of all images, bytes
  std::map<int, int> read_;  ///< results of image()
};

void read_metal(const JsonValue& properties, TextureReader& textures, Surface& surface) {
  if (const auto color = properties.find("baseColorFactor")) {
    color->numbers(4);  // refuses any other length
    const std::vector<JsonValue> channels = color->items();
    for (int i = 0; i < 3; ++i) surface.base_color[i] = channels[i].non_negative();
    surface.alpha = std::clamp(channels[3].non_negative(), 0.0, 1.0);
  }
  surface.metallic = unit_interval(properties, "metallicFactor");
  surface.roughness = unit_interval(properties, "roughnessFactor");
  surface.textures[Surface::color_texture] = textures.read(properties, "baseColorTexture");
  surface.textures[Surface::finish_texture] = textures.read(properties, "metallicRoughnessTexture");
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
  if (const auto mode = material.find("alphaMode")) {
    surface.opacity = mode->one_of<Surface::Opacity>({{"OPAQUE", Surface::Opacity::opaque},
                                                      {"MASK", Surface::Opacity::cut},
                                                      {"BLEND", Surface::Opacity::blended}});
    if (surface.opacity == Surface::Opacity::cut) {
      material.read("alphaCutoff", surface.cut_off, &JsonValue::non_negative);
    }
  }
  surface.is_double_sided = material.get("doubleSided", false, &JsonValue::boolean);
  surface.is_unlit = material.extension("KHR_materials_unlit").has_value();
  surface.textures[Surface::normal_texture] = textures.read(material, "normalTexture");
  if (const auto normal = material.find("normalTexture")) {
    normal->read("scale", surface.normal_scale, &JsonValue::number);
  }
  surface.textures[Surface::occlusion_texture] = textures.read(material, "occlusionTexture");
  if (const auto occlusion = material.find("occlusionTexture")) {
    surface.occlusion_strength = unit_interval(*occlusion, "strength");
  }
  surface.textures[Surface::emission_texture] = textures.read(material, "emissiveTexture");
  read_color(material, "emissiveFactor", surface.emission);
  if (const auto extension = material.extension("KHR_materials_emissive_strength")) {
    const double strength = extension->get("emissiveStrength", 1.0, &JsonValue::non_negative);
    for (double& level : surface.emission) level *= strength;
  }
  return surface;
}

/// Returns the pose of a camera or light, which faces its node's −Z, without the node's scale and shear.
Pose facing_pose(const NodeTransform& world, const JsonValue& node) {
  if (!world.sheared) return world.rigid();
  Matrix3 axes;
  axes.col(2) = world.linear.col(2).normalized();
  axes.col(0) = world.linear.col(1).cross(axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  if (!(std::fabs(axes.determinant()) > 0.5)) node.fail("its transform leaves no direction to face");
  return {world.translation, Quaternion(axes).normalized()};
}

void add_camera(const GltfDocument& document, const JsonValue& reference, const GltfNode& node,
                Scene& scene) {
  const JsonValue json = document.target_of(reference, "cameras", "camera");
  const auto perspective = json.find("perspective");
  if (!perspective) return reference.warn("only perspective cameras are drawn with; it is ignored");
  NamedCamera camera{node.name, json.name(""), {}};
  camera.view.vertical_field_of_view = perspective->require("yfov").positive();
  if (!(camera.view.vertical_field_of_view < std::numbers::pi)) {
    perspective->require("yfov").fail("must be less than pi");
  }
  camera.view.pose = facing_pose(node.world, reference);
  scene.cameras.push_back(std::move(camera));
}

void read_cone(const JsonValue& json, Light& light) {
  const double widest = std::numbers::pi / 2;
  light.outer_angle = widest / 2;
  const auto cone = json.find("spot");
  if (!cone) return;
  cone->read("innerConeAngle", light.inner_angle, &JsonValue::non_negative);
  cone->read("outerConeAngle", light.outer_angle, &JsonValue::positive);
  if (!(light.inner_angle < light.outer_angle && light.outer_angle <= widest)) {
    cone->fail("its angles must be 0 <= innerConeAngle < outerConeAngle <= pi / 2");
  }
}

/// Adds the light of a node: the first directional one as the sun.
void add_light(const JsonValue& json, const GltfNode& node, const JsonValue& reference, Scene& scene) {
  constexpr std::size_t most_lights = 16;  // as many as the renderer draws (most_lamps)
  Light light;
  light.kind = json.require("type").one_of<Light::Kind>({{"directional", Light::Kind::directional},
                                                         {"point", Light::Kind::point},
                                                         {"spot", Light::Kind::spot}});
  const bool is_sun = light.kind == Light::Kind::directional && !scene.sun;
  if (!is_sun && scene.lights.size() == most_lights) {
    return reference.warn("more than {} lights besides the sun: it is not drawn", most_lights);
  }
  if (light.kind != Light::Kind::point) {
    light.direction = facing_pose(node.world, reference).orientation * Vector3(0, 0, -1);
  }
  read_color(json, "color", light.color);
  json.read("intensity", light.intensity, &JsonValue::non_negative);
  if (is_sun) {
    scene.sun = Sun{light.direction, light.color, light.intensity};
    return;
  }
  light.position = node.world.translation;
  json.read("range", light.range, &JsonValue::positive);
  if (light.kind == Light::Kind::spot) read_cone(json, light);
  scene.lights.push_back(light);
}

/// Dims a sun of more than 30 lux, as files in photometric units have, to 3 lux, which the renderer's
/// exposure is made for. Divides the other lights by the same factor.
void expose(Scene& scene) {
  constexpr double brightest_without_exposure = 30;
  constexpr double exposed = 3;
  if (!scene.sun || !(scene.sun->illuminance > brightest_without_exposure)) return;
  for (Light& light : scene.lights) light.intensity *= exposed / scene.sun->illuminance;
  scene.sun->illuminance = exposed;
}

}  // namespace

std::vector<Surface> read_surfaces(GltfDocument& document, std::vector<SceneImage>& images) {
  std::vector<Surface> surfaces;
  TextureReader textures(document, images);
  for (const JsonValue& material : document.root().items("materials")) {
    surfaces.push_back(read_surface(material, surfaces.size(), textures));
  }
  surfaces.emplace_back().name = "no material";
  return surfaces;
}

void read_cameras_and_lights(const GltfDocument& document, Scene& scene) {
  const auto punctual = document.root().extension("KHR_lights_punctual");
  const std::vector<JsonValue> lights =
      punctual ? punctual->require("lights").items() : std::vector<JsonValue>{};
  for (std::size_t i = 0; i < document.nodes.size(); ++i) {
    const GltfNode& node = document.nodes[i];
    if (!node.in_scene) continue;
    const JsonValue json = document.item_of("nodes", i);
    if (const auto camera = json.find("camera")) add_camera(document, *camera, node, scene);
    if (const auto extension = json.extension("KHR_lights_punctual")) {
      const JsonValue reference = extension->require("light");
      add_light(lights[reference.index(lights.size(), "light")], node, reference, scene);
    }
  }
  expose(scene);
  if (!scene.cameras.empty()) scene.camera = scene.cameras.front().view;
}

}  // namespace substep
