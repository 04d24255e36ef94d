#include "sim/loading/scene_textures.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "sim/math/rotation.h"

namespace substep {
namespace {

bool can_be_decoded(std::string_view bytes) {
  return bytes.starts_with("\x89PNG\r\n\x1a\n") || bytes.starts_with("\xff\xd8\xff");
}

Eigen::Vector2d pair_in(const JsonValue& object, const char* key, double otherwise) {
  const auto given = object.find(key);
  if (!given) return Eigen::Vector2d::Constant(otherwise);
  const std::vector<JsonValue> numbers = given->items();
  if (numbers.size() != 2) given->fail("must be an array of 2 numbers");
  return {numbers[0].number(), numbers[1].number()};
}

int coordinate_set(const JsonValue& object, int otherwise) {
  const auto given = object.find("texCoord");
  if (!given) return otherwise;
  const std::uint64_t set = given->integer(0xffff);
  if (set > 1) given->fail(fmt::format("is {}; of texture coordinates two sets are read, 0 and 1", set));
  return static_cast<int>(set);
}

/// KHR_texture_transform: coordinates are scaled, turned, then moved.
void set_transform(const JsonValue& transform, Texture& texture) {
  const Eigen::Vector2d scale = pair_in(transform, "scale", 1);
  const SineCosine of = sine_cosine(get(transform, "rotation", 0.0, &JsonValue::number));
  texture.turn << of.cosine * scale.x(), of.sine * scale.y(), -of.sine * scale.x(), of.cosine * scale.y();
  texture.offset = pair_in(transform, "offset", 0);
  texture.coordinates = coordinate_set(transform, texture.coordinates);
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

}  // namespace

void TextureReader::set_sampler(const JsonValue& sampler, Texture& texture) {
  texture.wrap = {wrap_in(sampler, "wrapS"), wrap_in(sampler, "wrapT")};
  constexpr std::uint64_t nearest = 9728;
  constexpr std::uint64_t linear = 9729;
  constexpr std::uint64_t nearest_of_nearest = 9984;  // then linear of nearest, nearest of two, linear of two
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

int TextureReader::image(int index) {
  const auto [place, is_new] = read_.try_emplace(index, -1);
  if (!is_new) return place->second;
  const JsonValue json = document_.item_of("images", index);
  std::shared_ptr<const std::string> bytes;  // a file's are what was read of it, not a copy
  if (const auto uri = json.find("uri")) {
    const std::optional<UriBytes> read = read_uri(*uri, document_);
    if (!read) {
      warnings_.push_back(uri->path() + ": there is no such file: surfaces are drawn without it");
      return -1;
    }
    bytes = read->bytes;
  } else {
    bytes = std::make_shared<const std::string>(buffer_view(
        document_, json.require("bufferView").index(document_.size_of("bufferViews"), "buffer view")));
  }
  if (!can_be_decoded(*bytes)) {
    warnings_.push_back(json.path() + ": is neither PNG nor JPEG: surfaces are drawn without it");
    return -1;
  }
  // Many images may share bytes of a buffer, so that a small file asks for much.
  constexpr std::uint64_t most = std::uint64_t{1} << 28;
  bytes_ += bytes->size();
  if (bytes_ > most) json.fail(fmt::format("with it the images have more than {} bytes in all", most));
  place->second = static_cast<int>(images_.size());
  images_.push_back({document_.file_name + ": " + json.path(), std::move(bytes)});
  return place->second;
}

Texture TextureReader::read(const JsonValue& object, const char* key) {
  Texture texture;
  const auto info = object.find(key);
  if (!info) return texture;
  const JsonValue json =
      document_.item_of("textures", info->require("index").index(document_.size_of("textures"), "texture"));
  texture.coordinates = coordinate_set(*info, 0);
  if (const auto transform = info->extension("KHR_texture_transform")) set_transform(*transform, texture);
  if (const auto sampler = json.find("sampler")) {
    set_sampler(document_.item_of("samplers", sampler->index(document_.size_of("samplers"), "sampler")),
                texture);
  }
  if (const auto source = json.find("source")) {
    texture.image = image(source->index(document_.size_of("images"), "image"));
  } else {
    warnings_.push_back(json.path() + ": has no image that is read: surfaces are drawn without it");
  }
  return texture;
}

}  // namespace substep
