#pragma once
/// Sets up the process: open standard streams, and an end that leaves nothing half-written and prints a
/// message.

namespace substep {

/// Exit code: what was given cannot be used, or is not there.
inline constexpr int bad_input = 2;

/// Call first. Where a standard stream is closed, no file gets its number. SIGINT, SIGTERM and SIGHUP remove
/// what is half-written before they end the process; so does SIGPIPE, in silence, and a fault in a library,
/// with a sentence. Files above a limit of size are an error and no signal.
void prepare_process();

/// Throws Error when anything written to standard output did not arrive.
void flush_output();

/// "there is not enough memory for this", said without asking for more of it. Returns the exit code.
int refuse_for_memory() noexcept;

}  // namespace substep
