#pragma once
/// Sets up the standard streams, and makes a process that ends early remove its half-written files and print
/// a message.

namespace substep {

/// Exit code for input that is missing or cannot be used.
inline constexpr int bad_input = 2;

/// Sets up streams and signals; call it first. Opens closed standard streams, so that no opened file takes
/// their descriptors. SIGINT, SIGTERM, SIGHUP, SIGPIPE and a crash remove half-written files before they end
/// the process; SIGPIPE is silent, a crash prints a message. Reaching the limit of file size is reported as
/// an error of writing and raises no signal.
void prepare_process();

/// Throws Error where output to standard output was lost.
void flush_output();

/// Prints "there is not enough memory for this" without allocating. Returns the exit code.
int refuse_for_memory() noexcept;

}  // namespace substep
