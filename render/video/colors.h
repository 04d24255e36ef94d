#pragma once
/// The colours of films.

#include <array>
#include <cstdint>
#include <string>

#include "render/video/panel.h"

namespace substep::render {

using Color = std::array<std::uint8_t, 3>;

namespace film_colors {
inline constexpr Color ground{15, 18, 24};
inline constexpr Color surface{24, 29, 37};
inline constexpr Color grid{52, 60, 72};
inline constexpr Color bright{236, 240, 245};
inline constexpr Color quiet{146, 156, 170};
inline constexpr Color alarm{255, 92, 105};
}  // namespace film_colors

/// Return the panel's shade of inks.h, on dark ground and on white.
Color accent(const PanelChoice& panel);
Color accent_on_white(const PanelChoice& panel);

/// Returns `color` faded into the strip's ground. Drawing with an alpha would show as beads where a curve's
/// pieces meet.
Color faded(const Color& color);

std::string html_color(const Color& color);  ///< "#5db4ea"

}  // namespace substep::render
