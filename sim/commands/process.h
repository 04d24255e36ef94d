#pragma once
/// Sets up the process: open standard streams, and an end that leaves nothing half-written and prints a
/// message.

namespace substep {

/// Exit code of input that cannot be used, or is missing.
inline constexpr int bad_input = 2;

/// Sets up streams and signals; call it first. Keeps the numbers of closed standard streams from files.
/// SIGINT, SIGTERM and SIGHUP remove half-written files before they end the process; so do SIGPIPE, silently,
/// and a fault in a library, with a sentence. A limit of file size is an error and no signal.
void prepare_process();

/// Throws Error where output to standard output was lost.
void flush_output();

/// Prints "there is not enough memory for this" without allocating. Returns the exit code.
int refuse_for_memory() noexcept;

}  // namespace substep
