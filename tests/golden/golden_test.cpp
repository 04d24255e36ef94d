/// Tests each case of golden/suite.toml; the verdict tells whether simulation or renderer changed.
/// CTest runs the cases of an algorithm together.

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>

#include "golden/suite/suite.h"
#include "render/renderer.h"
#include "sim/error.h"
#include "tests/folders.h"
#include "tests/golden/small_suite.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

const fs::path own_suite = fs::path(test::source_folder) / "golden/suite.toml";

class GoldenTest : public testing::Test {
 public:
  explicit GoldenTest(std::string case_name) : case_name_(std::move(case_name)) {}

  void TestBody() override {
    CheckOptions options;
    options.suite = own_suite;
    options.cases = {case_name_};
    // Each test has a folder of its own: they run at the same time.
    options.output = fs::path(test::build_folder) / "check" / case_name_;
    const CheckResult result = check(options);
    EXPECT_EQ(result.exit_code, 0) << result.text;
  }

 private:
  std::string case_name_;
};

void register_cases(const Suite& suite) {
  for (const SuiteCase& entry : suite.cases) {
    testing::RegisterTest("golden", entry.name.c_str(), nullptr, nullptr, __FILE__, __LINE__,
                          [name = entry.name]() -> testing::Test* { return new GoldenTest(name); });
  }
}

TEST(golden_folder, HasNoOrphans) {
  for (const fs::path& orphan : orphans(read_suite(own_suite))) {
    ADD_FAILURE() << orphan << " belongs to no case: delete it, or put its case back";
  }
}

TEST(golden_folder, KeepsItsSizeBudget) {
  constexpr std::uintmax_t whole = 10'000'000;
  constexpr std::uintmax_t picture = 100'000;
  std::uintmax_t sum = 0;
  // Count the suite's media, not the sources beside them.
  for (const char* const part : {"images", "poses", "vectors"}) {
    for (const auto& entry : fs::recursive_directory_iterator(own_suite.parent_path() / part)) {
      if (!entry.is_regular_file()) continue;
      sum += entry.file_size();
      if (entry.path().extension() == ".png") {
        EXPECT_LE(entry.file_size(), picture) << entry.path();
      }
    }
  }
  EXPECT_LE(sum, whole);
}

}  // namespace
}  // namespace substep::golden

int main(int argc, char** argv) {
  try {
    substep::render::pin_renderer();
    testing::InitGoogleTest(&argc, argv);
    substep::golden::register_cases(substep::golden::read_suite(substep::golden::own_suite));
    return RUN_ALL_TESTS();
  } catch (const substep::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
