#include "sim/commands/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <string_view>

#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

// All functions up to handle() run in signal handlers: they make system calls and do not allocate.

/// Writes a line to stderr in place of the progress line.
void say(std::string_view line) noexcept {
  if (::isatty(STDERR_FILENO) != 0) {
    constexpr std::string_view clear_line = "\r\x1b[K";
    if (::write(STDERR_FILENO, clear_line.data(), clear_line.size()) < 0) return;
  }
  if (::write(STDERR_FILENO, line.data(), line.size()) < 0) return;
}

/// Ends the process by `signal`, so that its parent sees the signal as the cause.
void end_by(int signal) noexcept {
  std::signal(signal, SIG_DFL);
  sigset_t only;
  ::sigemptyset(&only);
  ::sigaddset(&only, signal);
  ::sigprocmask(SIG_UNBLOCK, &only, nullptr);
  ::kill(::getpid(), signal);
}

extern "C" void substep_ended_by_signal(int signal) {
  remove_partial_files();
  // Print nothing where the reader of a pipe has gone.
  if (signal != SIGPIPE) say("substep: interrupted: what was not finished is removed\n");
  end_by(signal);
}

bool memory_is_limited() noexcept {
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) return true;
  }
  return false;
}

extern "C" void substep_failed(int signal) {
  remove_partial_files();
  // Report missing memory: where it is limited, LLVM and Mesa abort or use null when they get none.
  if (memory_is_limited()) ::_exit(refuse_for_memory());
  say("substep: ended by a fault in it or in a library that it uses: please report it\n");
  end_by(signal);
}

void handle(int signal, void (*handler)(int)) {
  struct sigaction now {};
  // Keep signals that the parent ignores (nohup) or a sanitizer handles.
  if (::sigaction(signal, nullptr, &now) != 0 || now.sa_handler != SIG_DFL) return;
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_ONSTACK;
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

void prepare_process() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // Open standard output for reading, so that writing to it remains an error.
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGCHLD, SIG_DFL);  // ignored, it would discard the exit codes of children
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) handle(signal, substep_ended_by_signal);
  // Give handlers their own stack: one that overflows has no room for them.
  static std::array<char, 1 << 16> memory;
  stack_t stack{};
  stack.ss_sp = memory.data();
  stack.ss_size = memory.size();
  ::sigaltstack(&stack, nullptr);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) handle(signal, substep_failed);
}

void flush_output() {
  errno = 0;
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::cout && std::ferror(stdout) == 0) return;
  throw Error("standard output cannot be written{}{}", errno != 0 ? ": " : "",
              errno != 0 ? std::strerror(errno) : "");
}

int refuse_for_memory() noexcept {
  say("substep: there is not enough memory for this\n");
  return bad_input;
}

}  // namespace substep
