#pragma once
/// Numbers of figures for print, as typed.

#include <optional>
#include <string>
#include <string_view>

namespace substep::render {

/// Nothing where the text is no finite number.
std::optional<double> finite_number_in(std::string_view text);

/// "one-column", "two-columns" or millimetres, in mm. Throws Error, which names --width.
double print_width_in(const std::string& text);

}  // namespace substep::render
