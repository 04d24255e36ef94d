#pragma once
/// A problem that A1 did not solve, as a file that a test can load.

#include <string>
#include <string_view>

#include "sim/direct/mlcp.h"

namespace substep {

/// The problem as text, numbers at round-trip precision: what a run leaves when it could not solve one.
std::string to_text(const Mlcp& problem);

/// Reads what to_text wrote. Throws Error, with `what` (a file's name) and the line at its front.
Mlcp parse_mlcp(std::string_view text, const std::string& what);

}  // namespace substep
