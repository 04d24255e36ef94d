#include "render/commands/print_width.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "sim/error.h"

namespace substep::render {

std::optional<double> finite_number_in(std::string_view text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc{} || parsed.ptr != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

double print_width_in(const std::string& text) {
  if (text == "one-column") return 85;
  if (text == "two-columns") return 178;
  const std::optional<double> width = finite_number_in(text);
  if (!width || !(*width >= 40 && *width <= 1000)) {
    throw Error(fmt::format(
        "--width '{}': give one-column (85 mm), two-columns (178 mm) or 40 to 1000, in mm", text));
  }
  return *width;
}

}  // namespace substep::render
