// Types the commands of the visual regression suite one after another, as a user does.

#include <gmock/gmock.h>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class GoldenCommands : public Program {
 protected:
  /// Writes a suite of one short case.
  void SetUp() override {
    copy_scene("pendulum.gltf");
    write("suite.toml",
          "[defaults]\nframes = 10\nimages = [10]\nsize = [64, 36]\n"
          "[[case]]\nscene = \"pendulum.gltf\"\nalgorithms = [\"a3\"]\n");
  }

  Outcome check(int exit_code, const std::vector<std::string>& out) const {
    return expect("check --suite suite.toml --output checked", exit_code, out);
  }
};

TEST_F(GoldenCommands, CheckApproveAndDiffOneCase) {
  check(1, {"pendulum.a3"});
  printed("approve pendulum.a3 --reason 'the first goldens' --suite suite.toml --output checked");
  EXPECT_TRUE(has("poses/pendulum/a3.poses"));
  EXPECT_TRUE(has("images/pendulum/a3.f0010.png"));
  EXPECT_THAT(check(0, {}).out, testing::Not(HasSubstr("note")));
  expect("check pendulum --suite suite.toml --output checked", 0, {});
  printed("diff poses/pendulum/a3.poses poses/pendulum/a3.poses");

  // A heavier step changes the poses: the check says which case and what.
  write("suite.toml", content("suite.toml") + "settings = { substeps = 3 }\n");
  check(1, {"pendulum.a3", "changed"});
  expect_content("checked/pendulum.a3/player.html",
                 {"\"method\":\"the golden run\"", "\"as it runs now\"", "3 sub-steps"});
}

TEST_F(GoldenCommands, RefuseMissingSuiteOrCase) {
  for (const auto& [words, part] : {std::pair("check --suite nothing.toml", "nothing.toml"),
                                    {"check --suite suite.toml --case pendulum.a9", "pendulum.a9"}}) {
    expect(words, 2, {}, {part});
    // CI reads it: there was no check.
    EXPECT_THAT(content("out/check/junit.xml"), HasSubstr("errors=\"1\""));
  }
  refuses("approve pendulum.a3 --reason ... --suite suite.toml", "approve needs a reason");
  refuses("approve pendulum.a3 --reason none --suite suite.toml", "out/check");
}

}  // namespace
}  // namespace substep
