#include "sim/log/file_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, int failure) {
  throw Error(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(failure)));
}

bool is_device(const fs::path& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

/// True where both names denote one file, existing or not.
bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  const fs::path real_a = fs::weakly_canonical(fs::absolute(a), none);
  const fs::path real_b = fs::weakly_canonical(fs::absolute(b), none);
  return !real_a.empty() && real_a == real_b;
}

}  // namespace

OutputFile::OutputFile(const fs::path& file) : file_(file) {
  require_folder_of(file);
  if (is_device(file)) {
    // A rename would put a file in its place.
    descriptor_ = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor_ < 0) refuse(file, errno);
    return;
  }
  // A link goes on pointing to the file that it points to.
  std::error_code ignored;
  partial_ = std::make_unique<PartialFile>(fs::exists(file, ignored) ? fs::canonical(file) : file);
  descriptor_ = partial_->descriptor();
}

OutputFile::~OutputFile() {
  if (!partial_ && descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::write(std::string_view content) {
  constexpr std::size_t enough = 1 << 16;
  waiting_ += content;
  if (waiting_.size() >= enough) flush();
}

void OutputFile::flush() {
  std::string_view rest = waiting_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written >= 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      refuse(file_, errno);
    }
  }
  waiting_.clear();
}

void OutputFile::publish() {
  flush();
  if (partial_) {
    partial_->publish();
  } else if (::close(std::exchange(descriptor_, -1)) != 0) {
    refuse(file_, errno);
  }
}

void write_file(const fs::path& file, std::string_view content) {
  OutputFile output(file);
  output.write(content);
  output.publish();
}

std::optional<std::string> content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

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

void require_separate_files(std::span<const GivenFile> inputs, std::span<const GivenFile> outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const GivenFile& output = outputs[i];
    if (is_device(output.file)) continue;
    for (const GivenFile& input : inputs) {
      if (!is_same_file(output.file, input.file)) continue;
      throw Error(fmt::format("{}: is {} and would be overwritten as {}: give another name",
                              output.file.string(), input.role, output.role));
    }
    for (const GivenFile& other : outputs.first(i)) {
      if (!is_same_file(output.file, other.file)) continue;
      throw Error(fmt::format("{}: {} and {} are one file: give them different names", output.file.string(),
                              other.role, output.role));
    }
  }
}

}  // namespace substep
