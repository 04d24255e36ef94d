#pragma once
/// Handles one input, for the fuzz target and the replay of its corpus.

#include <string_view>

namespace substep::golden {

/// Bytes that begin with a line "pose-log", "track", "sidecar", "suite", "sweep" or "record" are read as a
/// file of that kind, without that line. Returns whether it was read rather than refused. Aborts when the
/// parsed content is impossible or a refusal does not name the file. Does not catch exceptions other than
/// Error.
bool reads_or_refuses(std::string_view bytes);

}  // namespace substep::golden
