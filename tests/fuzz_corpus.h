#pragma once
/// Reads the corpus of a fuzzer, and changes its files at random.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/folders.h"

namespace substep::test {

/// Returns the contents of the files in a folder of the sources, sorted by name.
inline std::vector<std::string> corpus(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(source_folder) / folder))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::string> contents;
  for (const std::filesystem::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    contents.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
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

}  // namespace substep::test
