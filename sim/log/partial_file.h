#pragma once
/// Hidden files and folders that are written beside their target and then renamed to it. None stays behind
/// after an error, SIGINT or SIGTERM; those of a killed process are removed when the same output is written
/// again.

#include <sys/types.h>

#include <filesystem>

namespace substep {

class PartialFile {
 public:
  enum class Kind { file, folder };

  /// Makes an empty file or folder beside `target`, under a name of this process alone, and locks it while
  /// this object lives. Removes those of `target` that no process holds. Throws Error.
  explicit PartialFile(std::filesystem::path target, Kind kind = Kind::file);
  ~PartialFile();  ///< removes it when it was not published
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }  ///< of a file: open for reading and writing

  /// Waits until the disk has it and renames it to `target`, which is then either whole or unchanged.
  /// A folder that is there must be empty. Throws Error.
  void publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  int descriptor_ = -1;
  int slot_ = -1;  ///< in the list of what remove_partial_files removes; −1: none
};

/// Registers a child process that writes to a partial file. It is ended before the file is removed, so that
/// it does not create it again.
class PartialFileWriter {
 public:
  explicit PartialFileWriter(pid_t process);
  ~PartialFileWriter();
  PartialFileWriter(const PartialFileWriter&) = delete;
  PartialFileWriter& operator=(const PartialFileWriter&) = delete;

 private:
  int slot_;
};

/// Removes all partial files of this process, which is about to end. Threads that make another one wait for
/// that end. May be called in a signal handler.
void remove_partial_files() noexcept;

/// Waits until the disk has the folder's entries, where the file system can.
void flush_folder(const std::filesystem::path& folder);

}  // namespace substep
