#pragma once
/// Hidden files and folders that are written beside their place and then renamed to it. None stays behind:
/// not after an error, not after SIGINT or SIGTERM, and what a killed process left goes when the same output
/// is written again.

#include <sys/types.h>

#include <filesystem>

namespace substep {

class PartialFile {
 public:
  enum class Kind { file, folder };

  /// Makes an empty one beside `target`, under a name that no other process gives, and holds a lock on it for
  /// as long as it lives. Those of `target` that no process holds are removed. Throws Error.
  explicit PartialFile(std::filesystem::path target, Kind kind = Kind::file);
  ~PartialFile();  ///< removes it when it was not published
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }  ///< of a file: open for reading and writing

  /// Waits until the disk has it and renames it to `target`: there it is whole, or what was there before is.
  /// A folder that is there must be empty. Throws Error.
  void publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  int descriptor_ = -1;
  int slot_ = -1;  ///< in the list of what remove_partial_files removes; −1: none
};

/// A child process that writes to a partial file, for as long as this lives: it is ended before the file is
/// removed, so that it does not make it anew.
class PartialFileWriter {
 public:
  explicit PartialFileWriter(pid_t process);
  ~PartialFileWriter();
  PartialFileWriter(const PartialFileWriter&) = delete;
  PartialFileWriter& operator=(const PartialFileWriter&) = delete;

 private:
  int slot_;
};

/// Removes all of this process, which is about to end; whoever makes another waits for that end. May be
/// called in a signal handler.
void remove_partial_files() noexcept;

/// Waits until the disk knows the folder's names. What a file system cannot do is left out.
void flush_folder(const std::filesystem::path& folder);

}  // namespace substep
