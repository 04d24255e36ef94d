#pragma once
/// What the runs of a comparison come to, for a terminal or a page.

#include <string>

#include "render/video/comparison.h"
#include "sim/measure/text_table.h"

namespace substep::render {

/// A line for each run but the reference: its settings, errors and row solves, and what became of it.
/// `with_times`: also its CPU time, which differs from time to time.
TextTable table_of(const Comparison& comparison, bool with_times);

/// What errors are measured from, and until when. Empty where they are not.
std::string words_on_reference(const Comparison& comparison);

}  // namespace substep::render
