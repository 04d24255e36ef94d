#include "sim/execution/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

namespace substep {
namespace {

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  pointers.reserve(texts.size() + 1);
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

TemporaryFile::TemporaryFile(std::string_view content) : file_(std::tmpfile(), &std::fclose) {
  const bool is_written = file_ != nullptr &&
                          std::fwrite(content.data(), 1, content.size(), file_.get()) == content.size() &&
                          std::fflush(file_.get()) == 0;
  if (!is_written)
    throw std::system_error(errno, std::generic_category(), "no temporary file can be written");
  std::rewind(file_.get());
}

std::string TemporaryFile::content() const {
  std::rewind(file_.get());
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file_.get())) {
    text.append(buffer.data(), count);
  }
  return text;
}

ChildProcess::ChildProcess(std::vector<std::string> words, const Streams& streams,
                           std::vector<std::string> environment) {
  for (char** entry = environ; *entry != nullptr; ++entry) environment.emplace_back(*entry);
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
  // Where this program ignores SIGPIPE, the other need not.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGPIPE);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int failure = ::posix_spawnp(&process_, words.front().c_str(), &actions, &attributes,
                                     pointers_to(words).data(), pointers_to(environment).data());
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure == 0) return;
  process_ = -1;
  throw std::system_error(failure, std::generic_category());
}

ChildProcess::~ChildProcess() {
  if (process_ < 0) return;
  ::kill(process_, SIGTERM);
  succeeds();
}

bool ChildProcess::succeeds() {
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace substep
