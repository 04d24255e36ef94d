// The commands of the visual regression suite, one after another as a user types them.

#include <gmock/gmock.h>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class GoldenCommands : public Program {
 protected:
  /// A suite of one short case.
  void SetUp() override {
    std::filesystem::copy_file(scene("pendulum.gltf"), folder() / "pendulum.gltf");
    write("suite.toml",
          "[defaults]\nframes = 10\nimages = [10]\nsize = [64, 36]\n"
          "[[case]]\nscene = \"pendulum.gltf\"\nalgorithms = [\"a3\"]\n");
  }

  Outcome check() const { return run({"check", "--suite", "suite.toml", "--output", "checked"}); }
};

TEST_F(GoldenCommands, CheckApproveAndDiffOneCase) {
  const Outcome fresh = check();
  EXPECT_EQ(fresh.exit_code, 1) << fresh.err;
  EXPECT_THAT(fresh.out, HasSubstr("pendulum.a3"));
  const Outcome approved = run({"approve", "pendulum.a3", "--reason", "the first goldens", "--suite",
                                "suite.toml", "--output", "checked"});
  ASSERT_EQ(approved.exit_code, 0) << approved.err;
  EXPECT_TRUE(std::filesystem::exists(folder() / "poses/pendulum/a3.poses"));
  EXPECT_TRUE(std::filesystem::exists(folder() / "images/pendulum/a3.f0010.png"));
  EXPECT_EQ(check().exit_code, 0);

  const Outcome same = run({"diff", "poses/pendulum/a3.poses", "poses/pendulum/a3.poses"});
  EXPECT_EQ(same.exit_code, 0) << same.err;

  // A heavier step changes the poses: the check says which case and what.
  write("suite.toml", content("suite.toml") + "settings = { substeps = 3 }\n");
  const Outcome changed = check();
  EXPECT_EQ(changed.exit_code, 1) << changed.err;
  EXPECT_THAT(changed.out, HasSubstr("pendulum.a3"));
  EXPECT_THAT(changed.out, HasSubstr("changed"));
  const std::string page = content("checked/pendulum.a3/player.html");
  for (const char* const part : {"\"method\":\"the golden run\"", "\"as it runs now\"", "3 sub-steps"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
}

TEST_F(GoldenCommands, CheckFailsWhereAGoldenIsNotTheApprovedOne) {
  check();
  ASSERT_EQ(
      run({"approve", "--failed", "--reason", "the first", "--suite", "suite.toml", "--output", "checked"})
          .exit_code,
      0);
  EXPECT_THAT(check().out, testing::Not(HasSubstr("note")));
  std::string log = content("poses/pendulum/a3.poses");
  const std::size_t header = log.find("substeps 10\n");
  ASSERT_NE(header, std::string::npos);
  write("poses/pendulum/a3.poses", log.replace(header, 12, "substeps 11\n"));
  const Outcome outcome = check();
  EXPECT_EQ(outcome.exit_code, 1) << outcome.out;
  EXPECT_THAT(outcome.out,
              HasSubstr("failed pendulum.a3: golden edited: a3.poses is not what was approved\n"));
}

TEST_F(GoldenCommands, RefuseWhatIsNotThere) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"check", "--suite", "nothing.toml"},
        {"check", "--suite", "suite.toml", "--case", "pendulum.a9"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, testing::HasSubstr(words.back()));
    // CI reads it: there was no check.
    EXPECT_THAT(content("out/check/junit.xml"), testing::HasSubstr("errors=\"1\""));
  }
  expect_refused({"approve", "pendulum.a3", "--reason", "none", "--suite", "suite.toml"}, "out/check");
}

}  // namespace
}  // namespace substep
