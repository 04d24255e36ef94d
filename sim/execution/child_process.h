#pragma once
/// Another program, started without a shell: its arguments may hold anything.

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace substep {

/// A file without a name, gone with this object: for what another program reads or writes.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::string_view content = {});  ///< throws std::system_error
  int descriptor() const { return ::fileno(file_.get()); }
  std::string content() const;

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

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

  /// Starts words[0], looked for in PATH unless it has a slash, with the other words as arguments.
  /// `environment`
  /// ("NAME=value") goes before this program's own. Throws std::system_error when it cannot be started.
  explicit ChildProcess(std::vector<std::string> words, const Streams& streams,
                        std::vector<std::string> environment = {});
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Ends the program if nobody has waited for it.
  ~ChildProcess();

  /// Waits until it has ended; whether it did so by itself, with exit code 0.
  bool succeeds();

 private:
  pid_t process_ = -1;
};

}  // namespace substep
