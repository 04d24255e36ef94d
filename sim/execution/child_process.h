#pragma once
/// Starts another program without a shell, so that its arguments need no quoting.

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace substep {

/// A file in memory without a name that another program reads or writes, also where the disk is full.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::string_view content = {});  ///< throws std::system_error
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile();
  int descriptor() const { return descriptor_; }
  std::string content() const;

 private:
  int descriptor_ = -1;
};

/// A started program, which the destructor kills unless its end is known.
class ChildProcess {
 public:
  static constexpr int inherited = -1;  ///< the stream is this program's own
  static constexpr int nowhere = -2;    ///< it is /dev/null

  /// File descriptors, which stay the caller's.
  struct Streams {
    int in = inherited;
    int out = inherited;
    int err = inherited;
  };

  /// Starts words[0], looked for in PATH unless it has a slash, with the other words as arguments. Throws
  /// std::system_error.
  ChildProcess(std::vector<std::string> words, const Streams& streams);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  pid_t id() const { return process_; }  ///< −1 once its end is known
  /// Returns whether the program ended by itself with exit code 0; nothing while it runs.
  std::optional<bool> ended();
  /// Waits until the program has ended, and returns true where it did so by itself with exit code 0.
  bool succeeds();
  /// Returns its exit code once its end is known, or minus the signal that ended it.
  int exit_code() const { return exit_code_; }

 private:
  std::optional<bool> reap(int flags);

  pid_t process_ = -1;
  int exit_code_ = 0;
};

}  // namespace substep
