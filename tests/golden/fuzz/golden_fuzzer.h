#pragma once
/// Handles one input, for the fuzz target and the replay of its corpus.

#include <string_view>

namespace substep::golden {

/// Bytes that begin with a line "pose-log", "track", "sidecar", "suite", "sweep" or "record" are read as a
/// file of that kind, without that line. True when it was read, false when it was refused. Aborts when what
/// was read cannot be, or when a refusal does not name the file; any exception but Error leaves it.
bool reads_or_refuses(std::string_view bytes);

}  // namespace substep::golden
