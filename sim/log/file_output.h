#pragma once
/// Writes files that appear only when they are complete.

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace substep {

/// A hidden file or folder that is written beside its target and then renamed to it. It is removed after an
/// error, SIGINT or SIGTERM. A killed process leaves it, until the same output is written again.
class PartialFile {
 public:
  enum class Kind { file, folder };

  /// Makes an empty file or folder beside `target`, under a name of this process alone, and locks it while
  /// this object lives. Removes partial files of `target` that no process has locked. Throws Error.
  explicit PartialFile(std::filesystem::path target, Kind kind = Kind::file);
  ~PartialFile();  ///< removes a partial file that was not published
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_; }  ///< of a file: open for reading and writing

  /// Waits until the content is on the disk, then renames the partial file to `target`; an existing folder
  /// must be empty. Throws Error where that fails, with `target` unchanged, or where closing fails after it.
  void publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
  int descriptor_ = -1;
  int slot_ = -1;  ///< in the list of remove_partial_files(); −1: none
};

/// The registration of a child process that writes to a partial file. remove_partial_files() ends the process
/// before it removes the file, which the process could create again.
class PartialFileWriter {
 public:
  explicit PartialFileWriter(pid_t process);
  ~PartialFileWriter();
  PartialFileWriter(const PartialFileWriter&) = delete;
  PartialFileWriter& operator=(const PartialFileWriter&) = delete;

 private:
  int slot_;
};

/// Removes all partial files of this process, which is about to end. Threads that make another partial file
/// wait until the process ends. May be called in a signal handler.
void remove_partial_files() noexcept;

/// A file that is written beside its target, and then renamed to it. Devices and pipes are written directly.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& file);  ///< throws Error
  ~OutputFile();                                           ///< keeps the old file without publish()
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view content);  ///< throws Error
  void publish();                        ///< throws Error as PartialFile::publish() does

 private:
  void flush();

  std::filesystem::path file_;
  std::optional<PartialFile> partial_;  ///< none for a device
  int descriptor_ = -1;
  std::string waiting_;  ///< not yet written
};

/// Writes `content` to a new file beside `file` and renames it to `file`. Throws Error as
/// PartialFile::publish() does. A device or a pipe is written to directly.
void write_file(const std::filesystem::path& file, std::string_view content);

/// Returns the file's bytes; nothing where it cannot be read.
std::optional<std::string> content_of(const std::filesystem::path& file);

/// Throws Error if the folder of `file` is missing or `file` is a folder; commands call it before they work.
void require_folder_of(const std::filesystem::path& file);

/// A file given to a command, and its role: "--output", or "the scene".
struct GivenFile {
  std::string role;
  std::filesystem::path file;
};

/// Throws Error when an output is an input or another output, under any name, so that no input is
/// overwritten. Devices and pipes may be named twice.
void require_separate_files(std::span<const GivenFile> inputs, std::span<const GivenFile> outputs);

}  // namespace substep
