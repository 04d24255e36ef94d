#pragma once
/// Handles one input, for the fuzz target and the replay of its corpus.

#include <string_view>

namespace substep {

/// Writes the bytes to a file of the format that they begin like and loads it as a scene. True when it
/// loaded, false when it was refused. Aborts when a loaded scene cannot be computed with, or a refusal does
/// not name the file; any exception but Error leaves it.
bool loads_or_is_refused(std::string_view bytes);

}  // namespace substep
