// Tests that the file of published results is read, refused and judged by its figures.

#include "sim/study/published.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/error_message.h"
#include "tests/scene_files.h"
#include "tests/temporary_folder.h"

namespace substep {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path scenes = scenes_folder();

const std::string head =
    "[[result]]\nname = \"P3\"\nscenes = [\"five_boxes.gltf\"]\nrule = \"A1\"\n"
    "reported = [[\"Kamino\", \"75 sweeps\", \"2 %\"]]\n";

class PublishedFile : public testing::Test {
 protected:
  void SetUp() override {
    fs::copy_file(scenes / "published/five_boxes.gltf", folder_.path() / "five_boxes.gltf");
  }

  std::vector<PublishedResult> read(const std::string& text) const {
    return read_published(folder_.write("p.toml", text));
  }

  test::TemporaryFolder folder_;
};

TEST_F(PublishedFile, JudgesByExpectationsOfScenes) {
  const auto results = read(
      head +
      "run = [{ name = 'few', algorithms = ['a1', 'a2'], settings = { substeps = 20 }, judged = ['a1'], "
      "quick = true }, { name = 'all', algorithms = ['a2'], settings = { substeps = 75 }, judged = ['a2'] }, "
      "{ name = 'gain', algorithms = ['a2'], settings = { substeps = 75 }, against = 'few', at_least = 2 "
      "}]\n");
  const auto all = measure_published(results, {});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_TRUE(all[0].is_met());
  ASSERT_EQ(all[0].figures.size(), 6u);
  EXPECT_TRUE(all[0].figures[0].measured.at(Algorithm::a2).is_bad());  // not judged
  EXPECT_FALSE(all[0].figures[2].measured.at(Algorithm::a2).is_bad());
  EXPECT_TRUE(all[0].figures[4].measured.at(Algorithm::a2).is_bad());  // a ratio near 1
  EXPECT_EQ(all[0].figures[4].run, "few over gain");

  PublishedOptions options;
  options.quick = true;
  EXPECT_EQ(measure_published(results, options).at(0).figures.size(), 2u);
  options.only = "P4";
  EXPECT_TRUE(measure_published(results, options).empty());
}

TEST_F(PublishedFile, FailsIfJudgedAlgorithmMisses) {
  const auto results =
      read(head +
           "run = [{ name = 'few', algorithms = ['a2'], settings = { substeps = 20 }, judged = ['a2'] }]\n");
  const auto measured = measure_published(results, {});
  EXPECT_FALSE(measured[0].is_met());
  const std::string page = to_markdown(measured);
  EXPECT_THAT(page, HasSubstr("**Lost by A2, few.**"));
  EXPECT_THAT(page, HasSubstr("- Kamino, 75 sweeps: 2 %"));
}

TEST_F(PublishedFile, RefusesMistakesByLine) {
  const auto run = [](const std::string& more) { return head + "run = [{ name = 'a', " + more + " }]\n"; };
  for (const auto& [text, words] :
       {std::pair(std::string(), "has no [[result]]"),
        {"[[result]]\nname = 3\n", "p.toml:2: 'name' must be a string"},
        {head, "'run' is missing"},
        {run("algorithms = ['a4']"), "must be a1, a2, a3 or a5"},
        {run("algorithms = ['a1'], judged = ['a5']"), "names A5, which is not run"},
        {run("settings = { tao = 1 }"), "p.toml:6: there is no setting 'tao'"},
        {run("against = 'b', at_least = 1"), "names no earlier run"},
        {run("at_least = 2"), "p.toml:6: 'at_least' needs 'against'"},
        {run("durations = 1"), "unknown key 'durations'"}})
    EXPECT_THAT(test::message_of([&, mistaken = text] { read(mistaken); }), HasSubstr(words));
  const auto too_short = read(run("duration = 0.0005"));
  EXPECT_THAT(test::message_of([&] { measure_published(too_short, {}); }), HasSubstr("measures nothing"));
}

// These results of the quick subset of scenes/published.toml must be met.
TEST(Published, QuickSubsetHolds) {
  PublishedOptions options;
  options.quick = true;
  const auto measured = measure_published(read_published(scenes / "published.toml"), options);
  std::vector<std::string> met;
  for (const PublishedMeasurement& one : measured) {
    if (one.is_met()) met.push_back(one.result.name.substr(0, 3));
  }
  EXPECT_THAT(met, testing::IsSupersetOf({"P2 ", "P3 ", "P6 ", "P8 "}));
}

}  // namespace
}  // namespace substep
