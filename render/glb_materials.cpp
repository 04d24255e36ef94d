#include "render/glb_materials.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace substep::render {
namespace {

using Json = GlbWriter::Json;

int wrap_number(Texture::Wrap wrap) {
  switch (wrap) {
    case Texture::Wrap::repeat:
      return 10497;
    case Texture::Wrap::mirrored:
      return 33648;
    case Texture::Wrap::clamped:
      return 33071;
  }
  return 10497;
}

int far_filter(const Texture& texture) {
  const int sharp = texture.is_sharp_far ? 0 : 1;
  switch (texture.levels) {
    case Texture::Levels::none:
      return 9728 + sharp;
    case Texture::Levels::nearest:
      return 9984 + sharp;
    case Texture::Levels::blended:
      return 9986 + sharp;
  }
  return 9987;
}

/// KHR_texture_transform scales, turns, then moves: the columns of `turn` are sx (cos, −sin) and sy (sin,
/// cos).
Json transform_of(const Texture& texture) {
  const Eigen::Vector2d x = texture.turn.col(0);
  const Eigen::Vector2d y = texture.turn.col(1);
  const bool by_x = x.norm() > 0;
  const double rotation = by_x ? std::atan2(-x.y(), x.x()) : std::atan2(y.x(), y.y());
  const double y_scale = by_x ? texture.turn.determinant() / x.norm() : y.norm();
  return {{"offset", {texture.offset.x(), texture.offset.y()}},
          {"rotation", rotation},
          {"scale", {x.norm(), y_scale}}};
}

void set_opacity(const Surface& surface, Json& material) {
  if (surface.opacity == Surface::Opacity::cut) {
    material["alphaMode"] = "MASK";
    material["alphaCutoff"] = surface.cut_off;
  } else if (surface.opacity == Surface::Opacity::blended) {
    material["alphaMode"] = "BLEND";
  }
}

}  // namespace

Json GlbMaterials::reference(const Texture& texture) {
  if (texture.image < 0) return nullptr;
  const auto [image, is_new] = images_.try_emplace(texture.image, 0);
  if (is_new) {
    image->second = writer_.add_image(*scene_.images[static_cast<std::size_t>(texture.image)].bytes);
  }
  const int sampler = writer_.add_once("samplers", {{"wrapS", wrap_number(texture.wrap[0])},
                                                    {"wrapT", wrap_number(texture.wrap[1])},
                                                    {"magFilter", texture.is_sharp_near ? 9728 : 9729},
                                                    {"minFilter", far_filter(texture)}});
  Json result = {{"index", writer_.add_once("textures", {{"sampler", sampler}, {"source", image->second}})},
                 {"texCoord", texture.coordinates}};
  if (!texture.turn.isIdentity(0) || !texture.offset.isZero(0)) {
    writer_.use("KHR_texture_transform");
    result["extensions"]["KHR_texture_transform"] = transform_of(texture);
  }
  return result;
}

int GlbMaterials::add(const Surface& surface) {
  const auto& [red, green, blue] = surface.base_color;
  Json finish = {{"baseColorFactor", {red, green, blue, surface.alpha}},
                 {"metallicFactor", surface.metallic},
                 {"roughnessFactor", surface.roughness}};
  Json material = {{"doubleSided", surface.has_back}};
  set_opacity(surface, material);
  const auto set_texture = [&](Surface::Role role, Json& object, const char* key) {
    if (Json texture = reference(surface.textures[role]); !texture.is_null())
      object[key] = std::move(texture);
  };
  set_texture(Surface::color_texture, finish, "baseColorTexture");
  set_texture(Surface::finish_texture, finish, "metallicRoughnessTexture");
  set_texture(Surface::normal_texture, material, "normalTexture");
  set_texture(Surface::occlusion_texture, material, "occlusionTexture");
  set_texture(Surface::emission_texture, material, "emissiveTexture");
  if (material.contains("normalTexture")) material["normalTexture"]["scale"] = surface.normal_scale;
  if (material.contains("occlusionTexture")) {
    material["occlusionTexture"]["strength"] = surface.occlusion_strength;
  }
  material["pbrMetallicRoughness"] = std::move(finish);
  if (const double strength = std::ranges::max(surface.emission); strength > 0) {
    // A factor is at most 1; what shines brighter has a strength beside it.
    const double over = std::max(strength, 1.0);
    for (const double level : surface.emission) material["emissiveFactor"].push_back(level / over);
    if (over > 1) {
      writer_.use("KHR_materials_emissive_strength");
      material["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", over}};
    }
  }
  if (surface.is_unlit) {
    writer_.use("KHR_materials_unlit");
    material["extensions"]["KHR_materials_unlit"] = Json::object();
  }
  return writer_.add_once("materials", material);
}

}  // namespace substep::render
