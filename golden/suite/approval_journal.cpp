#include "golden/suite/approval_journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "golden/compare/provenance.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* journal_format = "substep approval 1";
constexpr const char* journal_extension = ".approval";

[[noreturn]] void refuse(const fs::path& journal) {
  throw Error(fmt::format("{}: what an interrupted approval left is damaged: delete it, and approve again",
                          journal.string()));
}

fs::path normal_path(const fs::path& path) {
  return fs::absolute(path.empty() ? fs::path(".") : path).lexically_normal();
}

/// Goldens are below these folders, and nothing else may be written.
bool is_golden(const fs::path& file) {
  const bool climbs = std::find(file.begin(), file.end(), "..") != file.end();
  return !climbs && file.is_relative() && (*file.begin() == "poses" || *file.begin() == "images");
}

/// One line that names the files, then their contents.
std::string journal_of(const fs::path& suite_folder, std::span<const NewGolden> files) {
  Json list = Json::array();
  std::string contents;
  for (const NewGolden& file : files) {
    const fs::path name = normal_path(file.file).lexically_relative(normal_path(suite_folder));
    if (!is_golden(name)) {
      throw Error(
          fmt::format("{} is not a golden of the suite in {}", file.file.string(), suite_folder.string()));
    }
    list.push_back({{"file", name.generic_string()},
                    {"bytes", file.content.size()},
                    {"hash", content_hash(file.content)}});
    contents += file.content;
  }
  return Json{{"format", journal_format}, {"files", list}}.dump() + "\n" + contents;
}

std::vector<NewGolden> files_in(const fs::path& journal, const fs::path& suite_folder) {
  const std::string text = read_bytes(journal);
  const std::size_t line = text.find('\n');
  std::string_view rest = std::string_view(text).substr(std::min(line, text.size() - 1) + 1);
  std::vector<NewGolden> files;
  try {
    const Json header = Json::parse(text.substr(0, line));
    if (header.at("format") != journal_format) refuse(journal);
    for (const Json& entry : header.at("files")) {
      const fs::path file = entry.at("file").get<std::string>();
      const auto bytes = entry.at("bytes").get<std::size_t>();
      const std::string content(rest.substr(0, bytes));
      if (content_hash(content) != entry.at("hash") || !is_golden(file)) refuse(journal);
      rest.remove_prefix(bytes);
      files.push_back({suite_folder / file, content});
    }
  } catch (const Json::exception&) {
    refuse(journal);
  }
  return files;
}

/// Holds a file for one process at a time.
class FileLock {
 public:
  explicit FileLock(const fs::path& file) : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX);
  }
  ~FileLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int descriptor_;
};

void finish(const fs::path& journal, const fs::path& suite_folder) {
  const FileLock lock(journal);
  std::error_code none;
  if (!fs::exists(journal, none)) return;  // another process was first
  for (const NewGolden& file : files_in(journal, suite_folder)) {
    fs::create_directories(file.file.parent_path(), none);
    write_file(file.file, file.content);
  }
  fs::remove(journal);
  // A journal that came back after a power failure would undo what was approved since.
  flush_folder(journal.parent_path());
}

}  // namespace

void replace_goldens(const fs::path& suite_folder, const std::string& case_name,
                     std::span<const NewGolden> files) {
  const fs::path journal = normal_path(suite_folder) / ("." + case_name + journal_extension);
  write_file(journal, journal_of(suite_folder, files));
  finish(journal, suite_folder);
}

void finish_approvals(const fs::path& suite_folder) {
  std::vector<fs::path> journals;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(normal_path(suite_folder), none)) {
    if (entry.path().extension() == journal_extension) journals.push_back(entry.path());
  }
  std::sort(journals.begin(), journals.end());
  for (const fs::path& journal : journals) finish(journal, suite_folder);
}

}  // namespace substep
