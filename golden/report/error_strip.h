#pragma once
/// The errors of a run against the golden one over its frames, as a drawing.

#include <nlohmann/json.hpp>
#include <string>

namespace substep::golden {

/// An SVG of the largest shift in the picture (pixels) and the largest error of position (m), on logarithmic
/// axes, with three markers: first difference, half a pixel (predicted), first visible (drawn). `poses` is
/// that of a case in results.json. Empty when there is nothing to draw.
std::string error_strip(const nlohmann::ordered_json& poses);

}  // namespace substep::golden
