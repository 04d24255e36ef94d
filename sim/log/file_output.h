#pragma once
/// Files written whole or not at all.

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sim/log/partial_file.h"

namespace substep {

/// A file that is written piece by piece beside its target, and then renamed to it. Devices and pipes are
/// written directly.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& file);  ///< throws Error
  ~OutputFile();                                           ///< without publish() the file is as it was
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view content);  ///< throws Error
  void publish();                        ///< throws Error; then the file is as it was

 private:
  void flush();

  std::filesystem::path file_;
  std::unique_ptr<PartialFile> partial_;  ///< none for a device
  int descriptor_ = -1;
  std::string waiting_;  ///< not yet handed to the system
};

/// Writes `content` to a new file beside `file` and renames it over it. Throws Error; then `file` is as it
/// was. What is not a regular file (a device, a pipe) is written to directly.
void write_file(const std::filesystem::path& file, std::string_view content);

/// Returns the file's bytes; nothing where it cannot be read.
std::optional<std::string> content_of(const std::filesystem::path& file);

/// Throws Error when `file` could not be made because its folder is missing or it is a folder itself: for
/// commands that work long before they write.
void require_folder_of(const std::filesystem::path& file);

/// A file that a command was given, and how: "--output", or "the scene".
struct GivenFile {
  std::string role;
  std::filesystem::path file;
};

/// Throws Error when an output is an input or another output, under any name, so that no input is
/// overwritten. Devices and pipes may be named twice.
void require_separate_files(std::span<const GivenFile> inputs, std::span<const GivenFile> outputs);

}  // namespace substep
