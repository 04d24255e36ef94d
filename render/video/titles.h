#pragma once
/// Names, titles and colours of panels.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns the name before the title, in the panel's colour: "A5", "Bullet SI", "Reference".
std::string name_of(const PanelChoice& panel);
/// Returns the settings of the run: "n=4 m=1 stable  h=1/60".
std::string settings_of(const PanelChoice& panel);

/// Titles of panels: the settings that differ. The legend has the settings that are equal.
struct Titles {
  std::vector<std::string> words;  ///< by run, after its name: "2 sub-steps", "exact", ""
  std::string shared;              ///< "10 sub-steps · τ=0.6/0.9 · stable joints · 60 Hz"
};

/// Puts settings that differ between panels into their words, and the others into the legend. A panel's own
/// title replaces its words.
Titles titles_of(const std::vector<Run>& runs);

/// Returns the name of a run's curve, with the settings in which it differs from runs of the same name:
/// "A5 n=4".
std::string curve_name(const std::vector<Run>& runs, const PanelChoice& panel);

using Color = std::array<std::uint8_t, 3>;

namespace film_colors {
inline constexpr Color ground{15, 18, 24};
inline constexpr Color surface{24, 29, 37};
inline constexpr Color grid{52, 60, 72};
inline constexpr Color bright{236, 240, 245};
inline constexpr Color quiet{146, 156, 170};
inline constexpr Color alarm{255, 92, 105};
}  // namespace film_colors

/// Returns the panel's shade of render::inks, on dark ground and on white.
Color accent(const PanelChoice& panel);
Color accent_on_white(const PanelChoice& panel);

/// Returns `color` mixed with the strip's background. An alpha would show beads where a curve's segments
/// overlap.
Color faded(const Color& color);

std::string html_color(const Color& color);  ///< "#5db4ea"

}  // namespace substep::render
