/// Replays what fuzzing found: every file of the corpus loads or is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/folders.h"
#include "tests/scene/fuzz/scene_fuzzer.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

TEST(FuzzCorpus, EveryFileLoadsOrIsRefused) {
  const fs::path folder = fs::path(test::source_folder) / "tests/scene/fuzz/corpus";
  std::vector<fs::path> files;
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files.push_back(entry.path());
    bytes += entry.file_size();
  }
  std::sort(files.begin(), files.end());
  int loaded = 0;
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.filename().string());
    std::ifstream stream(file, std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(stream), {}};
    loaded += loads_or_is_refused(content);
  }
  EXPECT_GE(files.size(), 20u);
  EXPECT_GE(loaded, 5);  // else nothing but refusals is kept
  EXPECT_LE(bytes, 300'000u);
}

}  // namespace
}  // namespace substep
