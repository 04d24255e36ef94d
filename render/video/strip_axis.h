#pragma once
/// Labels of numbers in films, and the axes of the strips below a panel's picture.

#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

/// Returns a length of at most three digits for people: "1.23 m", "45.6 mm", "7.8 µm".
std::string length_label(double metres);

/// Returns an error against a reference that is uncertain by `certain`, m; smaller errors are "≤ 2.0 µm", or
/// "< 1 µm".
std::string error_label(double metres, double certain);

/// Returns an energy with its sign: "+1.23 kJ", "−45.6 mJ", "0 J".
std::string energy_label(double joules);

/// Decades of the error axis, the same in all panels.
struct ErrorScale {
  int lower = -3;  ///< powers of ten, m
  int upper = 0;

  double height(double metres) const;  ///< of an error in the strip: 0 at the bottom, 1 at the top
};
ErrorScale error_scale(const Comparison& comparison);

/// From their names. Throws Error.
std::vector<Strip> strips_named(const std::vector<std::string>& names);

/// Returns a run's values in a strip, by film frame.
const std::vector<double>& series_of(const Run& run, Strip strip);

/// The axis of a strip, the same in all panels: decades of metres, or numbers about a mark.
struct StripAxis {
  bool is_logarithmic = true;
  ErrorScale decades;
  double low = 0, high = 1;  ///< in `unit`
  double mark = 0;           ///< energy at the start, or what is expected
  std::string_view unit = "m";

  double height(double value) const;      ///< in the strip: 0 at the bottom, 1 at the top
  std::string label(double value) const;  ///< of a value that a run has
};
StripAxis axis_of(const Comparison& comparison, Strip strip);

/// Returns the strip's one word, as `--strip` takes it, and what it shows, for a legend.
std::string name_of(Strip strip);
std::string words_of(const Comparison& comparison, Strip strip);

}  // namespace substep::render
