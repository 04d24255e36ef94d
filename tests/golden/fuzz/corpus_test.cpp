/// Every file of the corpus is read, and what is made of it by a few changes is read or refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/folders.h"
#include "tests/golden/fuzz/golden_fuzzer.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> corpus() {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::directory_iterator(fs::path(test::source_folder) / "tests/golden/fuzz/corpus")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> contents;
  for (const fs::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    contents.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return contents;
}

TEST(GoldenFuzzCorpus, EveryFileIsReadOrRefused) {
  int read = 0;
  for (const std::string& content : corpus()) read += reads_or_refuses(content);
  EXPECT_GE(read, 6);  // one of each kind at least
}

TEST(GoldenFuzzCorpus, WhatChangesMakeOfThemIsReadOrRefused) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t size) { return static_cast<std::size_t>(random() % size); };
  int refused = 0;
  for (const std::string& content : corpus()) {
    const std::size_t body = content.find('\n') + 1;
    for (int i = 0; i < 300; ++i) {
      std::string changed = content;
      for (int changes = 1 + static_cast<int>(below(3)); changes > 0 && changed.size() > body; --changes) {
        const std::size_t at = body + below(changed.size() - body);
        switch (below(4)) {
          case 0:
            changed[at] = static_cast<char>(below(256));
            break;
          case 1:
            changed.erase(at, 1 + below(8));
            break;
          case 2:
            changed.insert(at, changed.substr(body + below(changed.size() - body), 1 + below(20)));
            break;
          default:
            changed.resize(at);
        }
      }
      refused += !reads_or_refuses(changed);
    }
  }
  EXPECT_GE(refused, 500);  // else the changes change nothing
}

}  // namespace
}  // namespace substep::golden
