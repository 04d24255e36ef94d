#pragma once
/// Sets up the standard streams, and an end of the process that leaves no half-written files and prints a
/// message.

namespace substep {

/// Exit code for input that is missing or cannot be used.
inline constexpr int bad_input = 2;

/// Sets up streams and signals; call it first. Opens closed standard streams, so that no file gets their
/// numbers. SIGINT, SIGTERM, SIGHUP, SIGPIPE and a fault in a library remove half-written files before they
/// end the process; SIGPIPE is silent, a fault prints a message. Reaching the limit of file size is an error,
/// not a signal.
void prepare_process();

/// Throws Error where output to standard output was lost.
void flush_output();

/// Prints "there is not enough memory for this" without allocating. Returns the exit code.
int refuse_for_memory() noexcept;

}  // namespace substep
