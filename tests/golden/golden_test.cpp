/// The goldens: two tests per case of golden/suite.toml, pose_golden.<case> and render_golden.<case>, so that
/// the list of failing tests already says which of simulation and renderer changed. CTest runs an algorithm's
/// together.

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>

#include "golden/check/check.h"
#include "golden/suite/suite.h"
#include "render/renderer.h"
#include "sim/error.h"

namespace substep::golden {
namespace {

namespace fs = std::filesystem;

const fs::path own_suite = fs::path(SUBSTEP_SOURCE_DIR) / "golden/suite.toml";

enum class Half { poses, images };

class GoldenTest : public testing::Test {
 public:
  GoldenTest(std::string case_name, Half half) : case_name_(std::move(case_name)), half_(half) {}

  void TestBody() override {
    CheckOptions options;
    options.suite = own_suite;
    options.cases = {case_name_};
    options.poses = half_ == Half::poses;
    options.images = half_ == Half::images;
    // Each test has a folder of its own: they run at the same time.
    options.output =
        fs::path(SUBSTEP_BINARY_DIR) / "check" / (options.poses ? "poses" : "images") / case_name_;
    const CheckResult result = check(options);
    EXPECT_EQ(result.exit_code(), 0) << result.cases.at(0).text;
  }

 private:
  std::string case_name_;
  Half half_;
};

void register_cases(const Suite& suite) {
  for (const SuiteCase& entry : suite.cases) {
    for (const auto& [half, group] :
         {std::pair(Half::poses, "pose_golden"), std::pair(Half::images, "render_golden")}) {
      testing::RegisterTest(
          group, entry.name.c_str(), nullptr, nullptr, __FILE__, __LINE__,
          [name = entry.name, half = half]() -> testing::Test* { return new GoldenTest(name, half); });
    }
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
