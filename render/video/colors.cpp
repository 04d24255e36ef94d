#include "render/video/colors.h"

#include <fmt/format.h>

#include "render/inks.h"

namespace substep::render {
namespace {

/// "#5db4ea".
Color color_in(const char* ink) {
  Color color{};
  for (std::size_t i = 0; i < color.size(); ++i) {
    const auto digit = [&](std::size_t at) { return ink[at] <= '9' ? ink[at] - '0' : ink[at] - 'a' + 10; };
    color[i] = static_cast<std::uint8_t>(16 * digit(1 + 2 * i) + digit(2 + 2 * i));
  }
  return color;
}

/// Returns `percent` of `color` over the rest of `below`.
Color mixed(const Color& color, const Color& below, int percent) {
  Color result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = static_cast<std::uint8_t>(below[i] + (color[i] - below[i]) * percent / 100);
  }
  return result;
}

/// Returns a shade of an ink: itself, then nearer to `away`, then fainter, and again.
Color shaded(const char* ink, int shade, const Color& away) {
  constexpr Color grey{100, 104, 112};
  const Color color = color_in(ink);
  return shade % 3 == 0 ? color : shade % 3 == 1 ? mixed(color, away, 45) : mixed(color, grey, 50);
}

}  // namespace

Color accent(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).dark, panel.shade, {255, 255, 255});
}

Color accent_on_white(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).light, panel.shade, {0, 0, 0});
}

Color faded(const Color& color) {
  return mixed(color, film_colors::surface, 38);
}

std::string html_color(const Color& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

}  // namespace substep::render
