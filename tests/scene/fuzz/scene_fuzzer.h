#pragma once
/// Handles one input, for the fuzz target and the replay of its corpus.

#include <string_view>

namespace substep {

/// Writes the bytes to a file of the format that their beginning suggests, and loads it as a scene. Returns
/// true where it loads, false where it is refused. Aborts where a loaded scene cannot be simulated, or where
/// the error does not name the file; does not catch exceptions other than Error.
bool loads_or_is_refused(std::string_view bytes);

}  // namespace substep
