#include "render/glb_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "render/textures.h"

namespace substep::render {
namespace {

// glTF's numbers for OpenGL's constants of these names.
constexpr int type_float = 5126;
constexpr int type_unsigned_int = 5125;
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;

void append(std::string& file, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) file += static_cast<char>(value >> (8 * i) & 0xff);
}

template <typename Number>
std::string_view bytes_of(const std::vector<Number>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)};
}

/// Returns KHR_texture_transform; the columns of `uv_matrix` are sx (cos, −sin) and sy (sin, cos).
GlbWriter::Json transform_of(const Texture& texture) {
  const Eigen::Vector2d x = texture.uv_matrix.col(0);
  const Eigen::Vector2d y = texture.uv_matrix.col(1);
  const bool by_x = x.norm() > 0;
  const double rotation = by_x ? std::atan2(-x.y(), x.x()) : std::atan2(y.x(), y.y());
  const double y_scale = by_x ? texture.uv_matrix.determinant() / x.norm() : y.norm();
  return {{"offset", {texture.offset.x(), texture.offset.y()}},
          {"rotation", rotation},
          {"scale", {x.norm(), y_scale}}};
}

}  // namespace

GlbWriter::GlbWriter() {
  root_["asset"] = {{"version", "2.0"}, {"generator", "substep"}};
  for (const char* const list : {"accessors", "bufferViews", "meshes", "materials", "nodes"}) {
    root_[list] = Json::array();
  }
}

int GlbWriter::add(const char* list, Json entry) {
  root_[list].push_back(std::move(entry));
  return static_cast<int>(root_[list].size()) - 1;
}

/// Returns the index of an entry of a list, the same for equal entries.
int GlbWriter::add_once(const char* list, const Json& entry) {
  const auto known = std::ranges::find(root_[list], entry);
  return known == root_[list].end() ? add(list, entry) : static_cast<int>(known - root_[list].begin());
}

int GlbWriter::add_floats(const std::vector<float>& values, int width, bool has_range, bool is_attribute) {
  static constexpr std::array types{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const auto wide = static_cast<std::size_t>(width);
  Json accessor = {{"bufferView", add_view(bytes_of(values), is_attribute ? array_buffer : 0)},
                   {"componentType", type_float},
                   {"count", values.size() / wide},
                   {"type", types.at(wide)}};
  if (has_range) {
    std::vector<float> low(values.begin(), values.begin() + width);
    std::vector<float> high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % wide] = std::min(low[i % wide], values[i]);
      high[i % wide] = std::max(high[i % wide], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }
  return add("accessors", std::move(accessor));
}

int GlbWriter::add_indices(const std::vector<std::uint32_t>& indices) {
  return add("accessors", {{"bufferView", add_view(bytes_of(indices), element_array_buffer)},
                           {"componentType", type_unsigned_int},
                           {"count", indices.size()},
                           {"type", "SCALAR"}});
}

/// Returns a material's reference to a texture; null where there is none.
GlbWriter::Json GlbWriter::texture_reference(const Texture& texture, const Scene& scene) {
  if (texture.image < 0) return nullptr;
  const auto [image, is_new] = images_.try_emplace(texture.image, 0);
  if (is_new) {
    const std::string& bytes = *scene.images[texture.image].bytes;
    const char* const type = bytes.starts_with("\x89PNG") ? "image/png" : "image/jpeg";
    image->second = add("images", {{"bufferView", add_view(bytes, 0)}, {"mimeType", type}});
  }
  const std::array<int, 4> sampling = sampling_of(texture);
  const int sampler = add_once("samplers", {{"wrapS", sampling[0]},
                                            {"wrapT", sampling[1]},
                                            {"magFilter", sampling[2]},
                                            {"minFilter", sampling[3]}});
  Json result = {{"index", add_once("textures", {{"sampler", sampler}, {"source", image->second}})},
                 {"texCoord", texture.coordinates}};
  if (!texture.uv_matrix.isIdentity(0) || !texture.offset.isZero(0)) {
    use("KHR_texture_transform");
    result["extensions"]["KHR_texture_transform"] = transform_of(texture);
  }
  return result;
}

int GlbWriter::add_material(const Surface& surface, const Scene& scene) {
  const auto& [red, green, blue] = surface.base_color;
  Json finish = {{"baseColorFactor", {red, green, blue, surface.alpha}},
                 {"metallicFactor", surface.metallic},
                 {"roughnessFactor", surface.roughness}};
  Json material = {{"doubleSided", surface.is_double_sided}};
  if (surface.opacity == Surface::Opacity::cut) {
    material["alphaMode"] = "MASK";
    material["alphaCutoff"] = surface.cut_off;
  } else if (surface.opacity == Surface::Opacity::blended) {
    material["alphaMode"] = "BLEND";
  }
  const auto set_texture = [&](Surface::Role role, Json& object, const char* key) {
    if (Json texture = texture_reference(surface.textures[role], scene); !texture.is_null())
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
    // A factor is at most 1; brighter emission has a strength beside it.
    const double over = std::max(strength, 1.0);
    for (const double level : surface.emission) material["emissiveFactor"].push_back(level / over);
    if (over > 1) {
      use("KHR_materials_emissive_strength");
      material["extensions"]["KHR_materials_emissive_strength"] = {{"emissiveStrength", over}};
    }
  }
  if (surface.is_unlit) {
    use("KHR_materials_unlit");
    material["extensions"]["KHR_materials_unlit"] = Json::object();
  }
  return add_once("materials", material);
}

std::string GlbWriter::bytes() {
  root_["scene"] = 0;
  std::vector<std::size_t> nodes(root_["nodes"].size());
  std::iota(nodes.begin(), nodes.end(), 0);
  root_["scenes"] = Json::array({{{"nodes", nodes}}});
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

/// Appends bytes as a buffer view. Images are padded to multiples of four bytes, so that views stay aligned.
/// x86-64 stores numbers as glTF does, the lowest byte first.
int GlbWriter::add_view(std::string_view data, int target) {
  Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", data.size()}};
  if (target != 0) view["target"] = target;
  binary_.append(data);
  binary_.resize((binary_.size() + 3) / 4 * 4);
  return add("bufferViews", std::move(view));
}

}  // namespace substep::render
