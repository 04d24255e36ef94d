#pragma once
/// Names, titles and colours of panels; numbers and results of a comparison as text.

#include <string>
#include <vector>

#include "render/text.h"
#include "render/video/comparison.h"
#include "sim/measure/text_table.h"

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

/// Returns a length of at most three digits: "1.23 m", "45.6 mm", "7.8 µm".
std::string length_label(double metres);

/// Returns an error against a reference that is uncertain by `certain`, m; smaller errors are "≤ 2.0 µm", or
/// "< 1 µm".
std::string error_label(double metres, double certain);

/// Returns an energy with its sign: "+1.23 kJ", "−45.6 mJ", "0 J".
std::string energy_label(double joules);

/// Returns a row for each run but the reference: its settings, errors, row solves and reason of an
/// early end. `with_times` adds its CPU time, which varies.
TextTable table_of(const Comparison& comparison, bool with_times);

/// Returns the reference's method, uncertainty and end; empty where there is no reference.
std::string words_on_reference(const Comparison& comparison);

}  // namespace substep::render
