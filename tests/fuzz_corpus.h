#pragma once
/// Reads the corpus of a fuzzer, changes its files at random, and handles one of them.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "sim/error.h"
#include "sim/log/file_output.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace substep::test {

/// Returns the contents of the files in a folder of the sources, sorted by name.
inline std::vector<std::string> corpus(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(source_folder) / folder))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::string> contents;
  for (const std::filesystem::path& file : files) contents.push_back(content_of(file).value());
  return contents;
}

/// Returns `bytes` with one to three changes at or after `from`, the same ones for the same `random`.
inline std::string changed(std::string bytes, std::size_t from, std::mt19937& random) {
  const auto below = [&](std::size_t size) { return static_cast<std::size_t>(random() % size); };
  for (std::size_t changes = 1 + below(3); changes > 0 && bytes.size() > from; --changes) {
    const std::size_t at = from + below(bytes.size() - from);
    switch (below(5)) {
      case 0:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 1:
        bytes.erase(at, 1 + below(8));
        break;
      case 2:
        bytes.insert(at, bytes.substr(from + below(bytes.size() - from), 1 + below(20)));
        break;
      case 3:
        bytes[at] = "0123456789-eE.,:[]{}\""[below(21)];
        break;
      default:
        bytes.resize(at);
    }
  }
  return bytes;
}

/// Aborts unless the condition holds.
inline void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "requirement failed: %s\n", what);
  std::abort();
}

/// Returns a folder that is removed when the program ends.
inline const std::filesystem::path& fuzz_folder() {
  static const TemporaryFolder folder;
  return folder.path();
}

/// Writes the bytes to a file in fuzz_folder() and reads it. Returns the message of the Error that refuses
/// it, nothing where it is read. Does not catch exceptions other than Error.
template <typename Read>
std::optional<std::string> refusal(const std::string& name, std::string_view bytes, const Read& read) {
  const std::filesystem::path file = fuzz_folder() / name;
  std::ofstream(file, std::ios::binary) << bytes;
  std::optional<std::string> message;
  try {
    read(file);
  } catch (const Error& error) {
    message = error.what();
  }
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  return message;
}

}  // namespace substep::test
