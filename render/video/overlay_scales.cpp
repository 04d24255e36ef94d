// The choice, scales and key of overlays.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "render/video/overlay.h"
#include "render/video/titles.h"
#include "sim/error.h"
#include "sim/measure/motion.h"

namespace substep::render {
namespace {

/// Returns the value below which a fraction of the values are; 0 where there are none.
double quantile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Returns the values above 0 of all runs' moving bodies at all frames.
std::vector<double> values_of(const Scene& scene, const Comparison& comparison,
                              std::vector<std::vector<float>> FrameQuantities::*series) {
  std::vector<double> values;
  for (const Run& run : comparison.runs) {
    for (const std::vector<float>& frame : run.quantities.*series) {
      for (std::size_t body = 1; body < frame.size(); ++body) {
        if (scene.bodies[body].inverse_mass > 0 && frame[body] > 0 && std::isfinite(frame[body]))
          values.push_back(frame[body]);
      }
    }
  }
  return values;
}

}  // namespace

using namespace overlay_colors;

Color ramp_at(double fraction) {
  const double position = std::clamp(fraction, 0.0, 1.0) * (tint_ramp.size() - 1);
  const auto index = std::min(static_cast<std::size_t>(position), tint_ramp.size() - 2);
  Color color{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double from = tint_ramp[index][c];
    const double to = tint_ramp[index + 1][c];
    color[c] =
        static_cast<std::uint8_t>(std::lround(from + (to - from) * (position - static_cast<double>(index))));
  }
  return color;
}

Overlays overlays_named(const std::vector<std::string>& names) {
  using Tint = Overlays::Tint;
  constexpr std::array<std::pair<std::string_view, bool Overlays::*>, 4> marks{
      {{"trails", &Overlays::trails},
       {"joints", &Overlays::joints},
       {"ghost", &Overlays::ghost},
       {"contacts", &Overlays::contacts}}};
  constexpr std::array<std::pair<std::string_view, Tint>, 3> tints{
      {{"error", Tint::error}, {"penetration", Tint::penetration}, {"velocity", Tint::speed}}};
  Overlays overlays;
  for (const std::string& name : names) {
    const auto is_named = [&](const auto& entry) { return entry.first == name; };
    if (const auto mark = std::ranges::find_if(marks, is_named); mark != marks.end()) {
      overlays.*mark->second = true;
      continue;
    }
    const auto tint = std::ranges::find_if(tints, is_named);
    if (tint == tints.end()) {
      throw Error(
          "--overlay '{}': give some of trails, joints, ghost, contacts, and error, penetration or velocity",
          name);
    }
    if (overlays.tint != Tint::none && overlays.tint != tint->second) {
      throw Error("--overlay '{}': bodies have one colour: give one of error, penetration and velocity",
                  name);
    }
    overlays.tint = tint->second;
  }
  return overlays;
}

OverlayScales scales_of(const Scene& scene, const Comparison& comparison, const Overlays& overlays) {
  OverlayScales scales;
  const StripAxis errors = axis_of(comparison, Strip::error);
  scales.low = std::pow(10.0, errors.lower);
  scales.high = std::pow(10.0, errors.upper);
  if (overlays.tint == Overlays::Tint::speed) {
    std::vector<double> speeds = values_of(scene, comparison, &FrameQuantities::speeds);
    const double high = quantile(speeds, 0.98);
    scales = {false, 0, high > 0 ? rounded_out(high) : 1};
  } else if (overlays.tint == Overlays::Tint::penetration) {
    std::vector<double> depths = values_of(scene, comparison, &FrameQuantities::depths);
    scales.high = std::pow(10.0, std::ceil(std::log10(std::max(quantile(depths, 0.995), 1e-6)) - 1e-9));
    scales.low = scales.high * 1e-3;
  }
  std::vector<double> impulses;
  for (const Run& run : comparison.runs) {
    for (const auto& contacts : run.quantities.contacts) {
      for (const ContactImpulse& contact : contacts) {
        if (!contact.impulse.isZero()) impulses.push_back(contact.impulse.norm());
      }
    }
  }
  // Draw a large impulse about a tenth of the scene long, with a round number of newton seconds in a metre.
  const double large = quantile(impulses, 0.9);
  if (large > 0) scales.metres_per_impulse = 1 / rounded_out(large / (0.1 * size_of(scene)));
  return scales;
}

std::vector<KeyEntry> key_of(const Overlays& overlays, const OverlayScales& scales, bool has_rings) {
  std::vector<KeyEntry> key;
  const auto add = [&](bool is_shown, const char* mark, const Color& color, const char* text) {
    if (!is_shown) return;
    key.emplace_back(mark, color);
    key.emplace_back(text, film_colors::quiet);
  };
  add(has_rings, "○ ", gap_color, "first away from the reference    ");
  add(overlays.trails, "— ", {200, 205, 214}, "the last second’s way    ");
  add(overlays.joints, "● ", white, "joint  ");
  add(overlays.joints, "●—● ", gap_color, "open joint, and the largest gap    ");
  add(overlays.ghost, "□ ", white, "where the reference is    ");
  add(overlays.contacts, "● ", idle_color, "contact  ");
  add(overlays.contacts, "●→ ", arrow_color, "its impulse in a step    ");
  if (overlays.tint == Overlays::Tint::none) return key;
  const bool is_speed = overlays.tint == Overlays::Tint::speed;
  const auto label = [&](double value) {
    return is_speed ? fmt::format("{:g} m/s", value) : length_label(value);
  };
  key.emplace_back(label(scales.low) + " ", film_colors::quiet);
  for (int i = 0; i < 9; ++i) key.emplace_back("■", ramp_at(i / 8.0));
  const char* const what = is_speed                                       ? "of the bodies’ centres"
                           : overlays.tint == Overlays::Tint::penetration ? "deep in other bodies"
                                                                          : "from the reference";
  key.emplace_back(fmt::format(" {} {}", label(scales.high), what), film_colors::quiet);
  return key;
}

}  // namespace substep::render
