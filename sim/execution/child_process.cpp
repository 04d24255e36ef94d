#include "sim/execution/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

namespace substep {

TemporaryFile::TemporaryFile(std::string_view content) : descriptor_(::memfd_create("substep", MFD_CLOEXEC)) {
  while (descriptor_ >= 0 && !content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0) break;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  if (descriptor_ >= 0 && content.empty() && ::lseek(descriptor_, 0, SEEK_SET) == 0) return;
  const int failure = errno;
  if (descriptor_ >= 0) ::close(descriptor_);
  throw std::system_error(failure, std::generic_category(), "no temporary file can be written");
}

TemporaryFile::~TemporaryFile() {
  ::close(descriptor_);
}

std::string TemporaryFile::content() const {
  std::string text;
  std::array<char, 4096> buffer{};
  // Read by offset, since the other program shares the descriptor's position.
  for (ssize_t count = 0;
       (count = ::pread(descriptor_, buffer.data(), buffer.size(), static_cast<off_t>(text.size()))) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return text;
}

ChildProcess::ChildProcess(std::vector<std::string> words, const Streams& streams) {
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  const std::array<int, 3> from{streams.in, streams.out, streams.err};
  for (int stream = 0; stream < 3; ++stream) {
    if (from[stream] == nowhere) {
      ::posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
    } else if (from[stream] != inherited) {
      ::posix_spawn_file_actions_adddup2(&actions, from[stream], stream);
    }
  }
  // Reset the signals that this program ignores.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGPIPE);
  ::sigaddset(&signals, SIGXFSZ);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int failure =
      ::posix_spawnp(&process_, arguments.front(), &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure == 0) return;
  process_ = -1;
  throw std::system_error(failure, std::generic_category());
}

ChildProcess::~ChildProcess() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);
  succeeds();
}

std::optional<bool> ChildProcess::reap(int flags) {
  int status = 127 << 8;  // exit code 127 where waitpid() fails
  pid_t found = 0;
  while ((found = ::waitpid(process_, &status, flags)) < 0 && errno == EINTR) {
  }
  if (found == 0) return std::nullopt;
  process_ = -1;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  return exit_code_ == 0;
}

std::optional<bool> ChildProcess::ended() {
  return reap(WNOHANG);
}

bool ChildProcess::succeeds() {
  return *reap(0);
}

}  // namespace substep
