#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/video/overlay.h"
#include "sim/error.h"
#include "sim/measure/motion.h"

namespace substep::render {
namespace {

/// The next of 1, 2, 5, 10, … that is not below a value.
double round_up(double value) {
  if (!(value > 0)) return 1;
  const double ten = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * ten * (1 + 1e-9)) return step * ten;
  }
  return 10 * ten;
}

/// Below which all but a part of the values are; 0 where there are none.
double quantile(std::vector<double>& values, double part) {
  if (values.empty()) return 0;
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Returns the values above 0 of all runs' moving bodies at all frames.
std::vector<double> values_of(const Scene& scene, const Comparison& comparison,
                              std::vector<std::vector<float>> Readings::*series) {
  std::vector<double> values;
  for (const Run& run : comparison.runs) {
    for (const std::vector<float>& frame : run.readings.*series) {
      for (std::size_t body = 1; body < frame.size(); ++body) {
        if (scene.bodies[body].inverse_mass > 0 && frame[body] > 0 && std::isfinite(frame[body]))
          values.push_back(frame[body]);
      }
    }
  }
  return values;
}

}  // namespace

Color ramp_at(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (error_ramp.size() - 1);
  const auto index = std::min(static_cast<std::size_t>(place), error_ramp.size() - 2);
  Color color{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double from = error_ramp[index][c];
    const double to = error_ramp[index + 1][c];
    color[c] =
        static_cast<std::uint8_t>(std::lround(from + (to - from) * (place - static_cast<double>(index))));
  }
  return color;
}

OverlayScales scales_of(const Scene& scene, const Comparison& comparison, const Overlays& overlays) {
  OverlayScales scales;
  const ErrorScale errors = error_scale(comparison);
  scales.low = std::pow(10.0, errors.lower);
  scales.high = std::pow(10.0, errors.upper);
  if (overlays.tint == Overlays::Tint::velocity) {
    std::vector<double> speeds = values_of(scene, comparison, &Readings::speeds);
    scales = {false, 0, round_up(quantile(speeds, 0.98))};
  } else if (overlays.tint == Overlays::Tint::penetration) {
    std::vector<double> depths = values_of(scene, comparison, &Readings::depths);
    scales.high = std::pow(10.0, std::ceil(std::log10(std::max(quantile(depths, 0.995), 1e-6)) - 1e-9));
    scales.low = scales.high * 1e-3;
  }
  std::vector<double> impulses;
  for (const Run& run : comparison.runs) {
    for (const std::vector<ContactImpulse>& frame : run.readings.contacts) {
      for (const ContactImpulse& contact : frame) {
        if (!contact.impulse.isZero()) impulses.push_back(contact.impulse.norm());
      }
    }
  }
  // A large one is as long as a tenth of the scene, and a metre is a round number of newton seconds.
  const double large = quantile(impulses, 0.9);
  if (large > 0) scales.metres_per_impulse = 1 / round_up(large / (0.1 * size_of(scene)));
  return scales;
}

Overlays overlays_named(const std::vector<std::string>& names) {
  Overlays overlays;
  const auto tint = [&](const std::string& name, Overlays::Tint kind) {
    if (overlays.tint != Overlays::Tint::none && overlays.tint != kind) {
      throw Error(
          fmt::format("--overlay '{}': bodies have one colour: give one of error, penetration and "
                      "velocity",
                      name));
    }
    overlays.tint = kind;
  };
  for (const std::string& name : names) {
    if (name == "trails") {
      overlays.trails = true;
    } else if (name == "joints") {
      overlays.joints = true;
    } else if (name == "ghost") {
      overlays.ghost = true;
    } else if (name == "contacts") {
      overlays.contacts = true;
    } else if (name == "error") {
      tint(name, Overlays::Tint::error);
    } else if (name == "penetration") {
      tint(name, Overlays::Tint::penetration);
    } else if (name == "velocity") {
      tint(name, Overlays::Tint::velocity);
    } else {
      throw Error(
          fmt::format("--overlay '{}': give some of trails, joints, ghost, contacts, and error, "
                      "penetration or velocity",
                      name));
    }
  }
  return overlays;
}

std::vector<KeyEntry> key_of(const Overlays& overlays, const OverlayScales& scales, bool has_rings) {
  constexpr Color words{146, 156, 170};
  std::vector<KeyEntry> key;
  if (has_rings) {
    key.emplace_back("○ ", gap_color);
    key.emplace_back("first away from the reference    ", words);
  }
  if (overlays.trails) {
    key.emplace_back("— ", Color{200, 205, 214});
    key.emplace_back("the last second’s way    ", words);
  }
  if (overlays.joints) {
    key.emplace_back("● ", anchor_color);
    key.emplace_back("joint  ", words);
    key.emplace_back("●—● ", gap_color);
    key.emplace_back("open joint, and the largest gap    ", words);
  }
  if (overlays.ghost) {
    key.emplace_back("□ ", ghost_color);
    key.emplace_back("where the reference is    ", words);
  }
  if (overlays.contacts) {
    key.emplace_back("● ", idle_color);
    key.emplace_back("contact  ", words);
    key.emplace_back("●→ ", arrow_color);
    key.emplace_back("its impulse in a step    ", words);
  }
  if (overlays.tint != Overlays::Tint::none) {
    const bool is_speed = overlays.tint == Overlays::Tint::velocity;
    const auto label = [&](double value) {
      return is_speed ? fmt::format("{:g} m/s", value) : length_label(value);
    };
    key.emplace_back(label(scales.low) + " ", words);
    for (int i = 0; i < 9; ++i) key.emplace_back("■", ramp_at(i / 8.0));
    const char* const what = is_speed                                       ? "of the bodies’ centres"
                             : overlays.tint == Overlays::Tint::penetration ? "deep in other bodies"
                                                                            : "from the reference";
    key.emplace_back(fmt::format(" {} {}", label(scales.high), what), words);
  }
  return key;
}

}  // namespace substep::render
