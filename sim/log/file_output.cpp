#include "sim/log/file_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view extension = ".partial";

[[noreturn]] void refuse(const fs::path& file, int failure) {
  throw Error("{}: cannot be written: {}", file.string(), std::strerror(failure));
}

bool is_device(const fs::path& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

/// Returns true if both names denote one file, existing or not.
bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code none;
  if (fs::equivalent(a, b, none)) return true;
  const fs::path real_a = fs::weakly_canonical(fs::absolute(a), none);
  const fs::path real_b = fs::weakly_canonical(fs::absolute(b), none);
  return !real_a.empty() && real_a == real_b;
}

/// A partial file in the table of those that a signal handler removes. The table's size is fixed, since a
/// handler may neither lock nor allocate. Files that find no room are removed by the next run.
struct Entry {
  enum State { unused, taken, listed };
  std::atomic<int> state{unused};
  std::array<char, 4096> path{};
};
std::array<Entry, 128> entries;
std::array<std::atomic<pid_t>, 16> writers;
std::atomic<bool> is_ending{false};

/// Enters a path in the table. Returns its slot; −1 where the table is full or the path too long.
int enter(const fs::path& path) {
  if (path.native().size() >= Entry{}.path.size()) return -1;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    int expected = Entry::unused;
    if (!entries[i].state.compare_exchange_strong(expected, Entry::taken)) continue;
    std::memcpy(entries[i].path.data(), path.c_str(), path.native().size() + 1);
    entries[i].state = Entry::listed;
    return static_cast<int>(i);
  }
  return -1;
}

void unlist(int& slot) {
  if (slot >= 0) entries[static_cast<std::size_t>(slot)].state = Entry::unused;
  slot = -1;
}

/// Removes a folder and the files in it, by system calls alone.
void remove_folder(const char* path) noexcept {
  // Try again, since another thread may be adding a file.
  for (int attempt = 0; attempt < 100 && ::rmdir(path) != 0 && errno == ENOTEMPTY; ++attempt) {
    const int folder = ::open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    alignas(8) std::array<char, 4096> buffer;
    for (long size = 0; (size = ::syscall(SYS_getdents64, folder, buffer.data(), buffer.size())) > 0;) {
      for (long offset = 0; offset < size;) {
        // struct linux_dirent64: inode and offset of 8 bytes, length of 2, type of 1, name.
        const char* const record = buffer.data() + offset;
        std::uint16_t length = 0;
        std::memcpy(&length, record + 16, sizeof length);
        const char* const name = record + 19;
        if (name[0] != '.' || (name[1] != '\0' && name[1] != '.')) ::unlinkat(folder, name, 0);
        offset += length;
      }
    }
    ::close(folder);
  }
}

/// Returns true where the path names the open file.
bool is_name_of(const fs::path& path, int descriptor) {
  struct stat named {};
  struct stat open {};
  return ::stat(path.c_str(), &named) == 0 && ::fstat(descriptor, &open) == 0 &&
         named.st_ino == open.st_ino && named.st_dev == open.st_dev;
}

bool is_partial(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with('.') && name.ends_with(extension);
}

/// Waits until a file or folder is on the disk. Returns 0 or the errno of a failure.
int flush(int descriptor) {
  // Ignore EINVAL, by which file systems report that they cannot do this.
  return ::fsync(descriptor) != 0 && errno != EINVAL ? errno : 0;
}

/// Waits until the file or folder at a path is on the disk. Returns 0 or an errno; 0 where it cannot be
/// opened.
int flush(const fs::path& path) {
  const int descriptor = ::open(path.empty() ? "." : path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return 0;
  const int failure = flush(descriptor);
  ::close(descriptor);
  return failure;
}

/// Removes partial files of `target` that no process has locked.
void remove_stale_files(const fs::path& target) {
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (is_partial(folder)) return;  // this process made the folder, so nothing in it is stale
  const std::string start = fmt::format(".{}.", target.filename().string());
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(start) || !name.ends_with(extension)) continue;
    const std::string_view number(name.data() + start.size(), name.size() - start.size() - extension.size());
    if (number.empty() || number.find_first_not_of("0123456789-") != std::string_view::npos) continue;
    const int descriptor = ::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), none);
    ::close(descriptor);
  }
}

/// Makes a file or folder and returns its descriptor; −1 and errno where that fails.
int make(const fs::path& path, PartialFile::Kind kind) {
  if (kind == PartialFile::Kind::file) {
    return ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  }
  if (::mkdir(path.c_str(), 0777) != 0) return -1;
  return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

}  // namespace

PartialFile::PartialFile(fs::path target, Kind kind) : target_(std::move(target)) {
  static std::atomic<int> count{0};
  if (is_device(target_)) throw Error("{}: cannot be replaced: it is a device", target_.string());
  remove_stale_files(target_);
  // Make another file if a process removes this one as stale before it is locked.
  do {
    if (descriptor_ >= 0) ::close(descriptor_);
    path_ = target_;
    path_.replace_filename(
        fmt::format(".{}.{}-{}{}", target_.filename().string(), ::getpid(), count.fetch_add(1), extension));
    unlist(slot_);
    slot_ = enter(path_);
    descriptor_ = make(path_, kind);
    if (descriptor_ < 0) {
      const int failure = errno;
      unlist(slot_);
      refuse(target_, failure);
    }
    if (is_ending) {  // remove_partial_files() has begun
      remove_partial_files();
      for (;;) ::pause();
    }
    // Ignore file systems without locks, on which later runs remove no stale files.
    ::flock(descriptor_, LOCK_EX);
  } while (!is_name_of(path_, descriptor_));
}

PartialFile::~PartialFile() {
  if (!path_.empty()) {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  unlist(slot_);
  if (descriptor_ >= 0) ::close(descriptor_);
}

void PartialFile::publish() {
  // Flush no file of a partial folder: the folder's publish() flushes all its files together, faster.
  const bool flushes = !is_partial(target_.parent_path());
  std::error_code none;
  int failure = 0;
  if (flushes && fs::is_directory(path_)) {
    for (const fs::directory_entry& entry : fs::directory_iterator(path_, none)) {
      if (failure == 0) failure = flush(entry.path());
    }
  }
  if (flushes && failure == 0) failure = flush(descriptor_);
  if (failure == 0 && ::rename(path_.c_str(), target_.c_str()) != 0) failure = errno;
  if (failure != 0) refuse(target_, failure);
  path_.clear();
  unlist(slot_);
  // Check close(): a network disk may report only here that it is full.
  if (::close(std::exchange(descriptor_, -1)) != 0) refuse(target_, errno);
  if (flushes) flush(target_.parent_path());
}

PartialFileWriter::PartialFileWriter(pid_t process) : slot_(-1) {
  for (std::size_t i = 0; i < writers.size() && slot_ < 0; ++i) {
    pid_t expected = 0;
    if (writers[i].compare_exchange_strong(expected, process)) slot_ = static_cast<int>(i);
  }
}

PartialFileWriter::~PartialFileWriter() {
  if (slot_ >= 0) writers[static_cast<std::size_t>(slot_)] = 0;
}

void remove_partial_files() noexcept {
  is_ending = true;
  for (std::atomic<pid_t>& writer : writers) {
    if (writer == 0) continue;
    ::kill(writer, SIGKILL);
    ::waitpid(writer, nullptr, 0);
  }
  for (const Entry& entry : entries) {
    if (entry.state != Entry::listed) continue;
    if (::unlink(entry.path.data()) != 0 && errno == EISDIR) remove_folder(entry.path.data());
  }
}

OutputFile::OutputFile(const fs::path& file) : file_(file) {
  require_folder_of(file);
  if (is_device(file)) {
    // Write to the device itself: a rename would replace it by a file.
    descriptor_ = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor_ < 0) refuse(file, errno);
    return;
  }
  // Write to the target of a link, so that the link remains. Another program may remove either meanwhile.
  std::error_code missing;
  const fs::path target = fs::canonical(file, missing);
  partial_.emplace(missing ? file : target);
  descriptor_ = partial_->descriptor();
}

OutputFile::~OutputFile() {
  if (!partial_ && descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::write(std::string_view content) {
  constexpr std::size_t buffer_size = 1 << 16;
  waiting_ += content;
  if (waiting_.size() >= buffer_size) flush();
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
  if (!stream || fs::is_directory(file)) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

void require_folder_of(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw Error("{}: cannot be written: there is no folder {}", file.string(), folder.string());
  if (fs::is_directory(file, ignored)) throw Error("{}: cannot be written: it is a folder", file.string());
}

void require_separate_files(std::span<const GivenFile> inputs, std::span<const GivenFile> outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const GivenFile& output = outputs[i];
    if (is_device(output.file)) continue;
    for (const GivenFile& input : inputs) {
      if (!is_same_file(output.file, input.file)) continue;
      throw Error("{}: is {} and would be overwritten as {}: give another name", output.file.string(),
                  input.role, output.role);
    }
    for (const GivenFile& other : outputs.first(i)) {
      if (!is_same_file(output.file, other.file)) continue;
      throw Error("{}: {} and {} are one file: give them different names", output.file.string(), other.role,
                  output.role);
    }
  }
}

}  // namespace substep
