#include "render/report/gnuplot.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "sim/error.h"

namespace substep {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// A file without a name, gone when it is closed.
File temporary_file() {
  File file(std::tmpfile(), &std::fclose);
  if (!file) throw Error(fmt::format("no temporary file can be made: {}", std::strerror(errno)));
  return file;
}

std::string content_of(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file)) {
    text.append(buffer.data(), count);
  }
  return text;
}

}  // namespace

std::string gnuplot(const std::string& script) {
  const File in = temporary_file();
  const File out = temporary_file();
  const File messages = temporary_file();
  if (std::fputs(script.c_str(), in.get()) < 0 || std::fflush(in.get()) != 0) {
    throw Error(fmt::format("a temporary file cannot be written: {}", std::strerror(errno)));
  }
  std::rewind(in.get());
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(in.get()), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(out.get()), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(messages.get()), STDERR_FILENO);
  std::string program = "gnuplot";
  std::array<char*, 2> arguments{program.data(), nullptr};
  pid_t process = -1;
  const int failure = ::posix_spawnp(&process, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0) {
    throw Error(
        fmt::format("the program gnuplot, which draws figures, cannot be started ({}): on Debian, "
                    "apt-get install gnuplot-nox",
                    std::strerror(failure)));
  }
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  std::string text = content_of(out.get());
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || text.empty()) {
    throw Error(fmt::format("gnuplot failed: {}", content_of(messages.get())));
  }
  return text;
}

}  // namespace substep
