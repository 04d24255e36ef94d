#pragma once
/// Starts another program without a shell, so that its arguments need no quoting.

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace substep {

/// A nameless file in memory that another program reads or writes, even where the disk is full.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::string_view content = {});  ///< throws std::system_error
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile();
  int descriptor() const { return descriptor_; }
  std::string content() const;  ///< returns all bytes, without moving the descriptor's position

 private:
  int descriptor_ = -1;
};

/// A started program, which the destructor kills unless its end is known.
class ChildProcess {
 public:
  static constexpr int inherited = -1;  ///< the stream is this program's own
  static constexpr int nowhere = -2;    ///< the stream is /dev/null

  /// File descriptors, which stay the caller's.
  struct Streams {
    int in = inherited;
    int out = inherited;
    int err = inherited;
  };

  /// Starts words[0], found in PATH unless it has a slash, with the other words. Throws std::system_error.
  ChildProcess(std::vector<std::string> words, const Streams& streams);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  pid_t id() const { return process_; }  ///< −1 once the program's end is known
  /// Returns true if the program ended by itself with exit code 0, false if it failed; nothing while it runs.
  std::optional<bool> ended();
  /// Waits until the program has ended, and returns true where it did so by itself with exit code 0.
  bool succeeds();
  /// Returns the program's exit code, or minus the signal that ended it, once the end is known.
  int exit_code() const { return exit_code_; }

 private:
  std::optional<bool> reap(int flags);

  pid_t process_ = -1;
  int exit_code_ = 0;
};

}  // namespace substep
