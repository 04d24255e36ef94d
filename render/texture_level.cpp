#include "render/texture_level.h"

#include <algorithm>
#include <cstddef>

#include "render/resolve.h"

namespace substep::render {

TextureLevel first_level(const Texels& texels, bool is_color) {
  TextureLevel level{texels.width, texels.height, std::vector<std::uint16_t>(texels.rgba.size())};
  for (std::size_t i = 0; i < texels.rgba.size(); ++i) {
    const bool is_light = is_color && i % 4 != 3;
    level.numbers[i] =
        is_light ? linear_light(texels.rgba[i]) : static_cast<std::uint16_t>(texels.rgba[i] * 257);
  }
  return level;
}

TextureLevel halved(const TextureLevel& level) {
  TextureLevel half{std::max(1, level.width / 2), std::max(1, level.height / 2), {}};
  half.numbers.resize(std::size_t{4} * half.width * half.height);
  const auto at = [&](int x, int y, int c) {
    const auto u = static_cast<std::size_t>(std::min(x, level.width - 1));
    const auto v = static_cast<std::size_t>(std::min(y, level.height - 1));
    return static_cast<int>(
        level.numbers[4 * (v * static_cast<std::size_t>(level.width) + u) + static_cast<std::size_t>(c)]);
  };
  std::size_t to = 0;
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (int c = 0; c < 4; ++c) {
        const int sum = at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c) +
                        at(2 * x + 1, 2 * y + 1, c);
        half.numbers[to++] = static_cast<std::uint16_t>((sum + 2) / 4);
      }
    }
  }
  return half;
}

Texels texels_of(const TextureLevel& level, bool is_color) {
  Texels texels{level.width, level.height, std::vector<std::uint8_t>(level.numbers.size())};
  for (std::size_t i = 0; i < level.numbers.size(); ++i) {
    const bool is_light = is_color && i % 4 != 3;
    texels.rgba[i] =
        is_light ? nearest_code(level.numbers[i]) : static_cast<std::uint8_t>((level.numbers[i] + 128) / 257);
  }
  return texels;
}

}  // namespace substep::render
