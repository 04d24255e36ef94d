#include "render/smaller_images.h"

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include "render/image.h"
#include "render/texture_level.h"

namespace substep::render {
namespace {

/// Smaller ones show no image, and hardly take fewer bytes.
constexpr int shortest_side = 16;

/// By Exif data browsers may turn an image, which glTF and the renderer do not.
bool may_be_turned(std::string_view file) {
  return file.find("Exif") != std::string_view::npos || file.find("eXIf") != std::string_view::npos;
}

/// An image as it shrinks.
class Shrinking {
 public:
  Shrinking(const SceneImage& image, bool is_color, int longest)
      : level_(first_level(decode_texels(*image.bytes, image.place), is_color)),
        is_color_(is_color),
        file_(image.bytes) {
    if (side() > longest) {
      shrink_to(longest);
    } else if (may_be_turned(*file_)) {
      encode();
    }
  }

  int side() const { return std::max(level_.width, level_.height); }
  const std::shared_ptr<const std::string>& file() const { return file_; }

  void shrink_to(int longest) {
    if (side() <= longest) return;
    while (side() > longest) level_ = halved(level_);
    encode();
  }

 private:
  void encode() { file_ = std::make_shared<const std::string>(to_png(texels_of(level_, is_color_))); }

  TextureLevel level_;
  bool is_color_;
  std::shared_ptr<const std::string> file_;
};

/// By the scene's index whether it is averaged as colour; one that is laid on as both is.
std::map<int, bool> images_of(std::span<const Surface> surfaces) {
  std::map<int, bool> images;
  for (const Surface& surface : surfaces) {
    for (std::size_t role = 0; role < surface.textures.size(); ++role) {
      const int image = surface.textures[role].image;
      if (image < 0) continue;
      images[image] |= role == Surface::color_texture || role == Surface::emission_texture;
    }
  }
  return images;
}

}  // namespace

Scene with_smaller_images(const Scene& scene, std::span<const Surface> surfaces, const ImageLimits& limits) {
  std::map<int, Shrinking> shrinking;
  for (const auto& [image, is_color] : images_of(surfaces)) {
    const SceneImage& source = scene.images[static_cast<std::size_t>(image)];
    shrinking.try_emplace(image, source, is_color, limits.longest);
  }
  const auto bytes = [&] {
    return std::accumulate(
        shrinking.begin(), shrinking.end(), std::size_t{0},
        [](std::size_t sum, const auto& entry) { return sum + entry.second.file()->size(); });
  };
  for (int side = limits.longest / 2; side >= shortest_side && bytes() > limits.bytes; side /= 2) {
    for (auto& [image, one] : shrinking) one.shrink_to(side);
  }
  Scene smaller = scene;
  for (const auto& [image, one] : shrinking) {
    smaller.images[static_cast<std::size_t>(image)].bytes = one.file();
  }
  return smaller;
}

}  // namespace substep::render
