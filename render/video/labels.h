#pragma once
/// Numbers and results of a comparison as text.

#include <string>

#include "render/video/comparison.h"
#include "sim/measure/text_table.h"

namespace substep::render {

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
