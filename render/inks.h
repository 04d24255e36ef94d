#pragma once
/// The colours of algorithms and engines in all our films and figures. On white, orange to sky are Okabe and
/// Ito's palette, which colour-blind people tell apart too.

#include <array>
#include <string_view>

#include "sim/model/settings.h"

namespace substep::render {

/// A colour on white, and its counterpart on a dark background, as #rrggbb.
struct Ink {
  const char* light;
  const char* dark;
};

/// 0 ink, 1 orange, 2 blue, 3 green, 4 vermilion, 5 purple, 6 sky, 7 grey; then three that differ from these
/// also for the colour-blind: 8 brown, 9 violet, 10 lavender.
inline constexpr std::array<Ink, 11> inks{{{"#222222", "#e6e6e6"},
                                           {"#e69f00", "#f0b73a"},
                                           {"#0072b2", "#5db4ea"},
                                           {"#009e73", "#3fd0a4"},
                                           {"#d55e00", "#ff8a3d"},
                                           {"#cc79a7", "#e8a3c8"},
                                           {"#56b4e9", "#8fd0f5"},
                                           {"#8c8c8c", "#9d9d9d"},
                                           {"#553300", "#b3854d"},
                                           {"#3300ff", "#8a7bff"},
                                           {"#7766ff", "#c4bcff"}}};

/// Returns the index: A1 ink, A2 orange, A3 blue, A4 green, A5 vermilion, Soft Step purple, AVBD sky.
constexpr int hue_of(Algorithm algorithm) {
  return static_cast<int>(algorithm);
}

/// Returns the index of `inks` of an engine: Bullet brown, MuJoCo violet, MuJoCo 3 lavender, commands grey.
/// Jolt, Rapier and ODE have the inks of A2, A4 and AVBD, which are seldom beside them.
constexpr int hue_of_engine(std::string_view name) {
  if (name.starts_with("jolt")) return 1;
  if (name.starts_with("rapier")) return 3;
  if (name.starts_with("ode")) return 6;
  if (name.starts_with("bullet")) return 8;
  if (name.starts_with("mujoco3")) return 10;
  return name.starts_with("mujoco") ? 9 : 7;
}

}  // namespace substep::render
