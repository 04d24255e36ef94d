#include "sim/log/file_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>

#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// Writes everything and closes. Returns 0 or the errno of what failed.
int write_and_close(int descriptor, std::string_view content) {
  int failure = 0;
  while (!content.empty() && failure == 0) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written >= 0) {
      content.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      failure = errno;
    }
  }
  // A full disk over a network may show only here.
  if (::close(descriptor) != 0 && failure == 0) failure = errno;
  return failure;
}

[[noreturn]] void refuse(const fs::path& file, int failure) {
  throw Error(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(failure)));
}

}  // namespace

void require_folder_of(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw Error(fmt::format("{}: cannot be written: there is no folder {}", file.string(), folder.string()));
  }
  if (fs::is_directory(file, ignored)) {
    throw Error(fmt::format("{}: cannot be written: it is a folder", file.string()));
  }
}

fs::path partial_file(const fs::path& file) {
  static std::atomic<int> count{0};
  fs::path partial = file;
  partial.replace_filename(
      fmt::format(".{}.{}-{}.partial", file.filename().string(), ::getpid(), count.fetch_add(1)));
  return partial;
}

void write_file(const fs::path& file, std::string_view content) {
  require_folder_of(file);
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    // A device or a pipe is written to: a rename would put a file in its place.
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) refuse(file, errno);
    if (const int failure = write_and_close(descriptor, content)) refuse(file, failure);
    return;
  }
  // A link goes on pointing to the file that it points to.
  const fs::path target = fs::exists(status) ? fs::canonical(file) : file;
  const fs::path partial = partial_file(target);
  const int descriptor = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) refuse(file, errno);
  int failure = write_and_close(descriptor, content);
  if (failure == 0 && ::rename(partial.c_str(), target.c_str()) != 0) failure = errno;
  if (failure != 0) {
    ::unlink(partial.c_str());
    refuse(file, failure);
  }
}

}  // namespace substep
