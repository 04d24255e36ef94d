// substep measure --reference: its table, messages and refusals.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class ReferenceCommand : public Program {
 protected:
  std::vector<std::vector<std::string>> table(const std::string& file) const {
    std::istringstream text(content(file));
    std::vector<std::vector<std::string>> lines;
    for (std::string line; std::getline(text, line);) {
      std::istringstream fields(line);
      lines.emplace_back();
      for (std::string field; std::getline(fields, field, ',');) lines.back().push_back(field);
    }
    return lines;
  }
};

TEST_F(ReferenceCommand, WritesThePosesWithTheirUncertainty) {
  const Outcome outcome =
      run({"measure", scene("pendulum.gltf"), "--reference", "pendulum.csv", "--duration", "1.95"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("pendulum: own of order 12 at h/"));
  EXPECT_THAT(outcome.out, HasSubstr("wrote pendulum.csv\n"));
  EXPECT_EQ(files(), std::vector<std::string>{"pendulum.csv"});
  const auto lines = table("pendulum.csv");
  ASSERT_EQ(lines.size(), 1U + 118U);
  EXPECT_EQ(lines[0].back(), "turn_uncertainty");
  // A period, 1.93333485 s: it is level and stands, but for 1e-6 s; the table has its samples at 1.93333 s.
  const std::vector<std::string>& period = lines.at(1 + 116);
  ASSERT_EQ(period.size(), 17U);
  EXPECT_NEAR(std::stod(period[0]), 116.0 / 60, 1e-12);
  EXPECT_EQ(period[1], "rod");
  EXPECT_NEAR(std::stod(period[2]), 0.5, 1e-10);
  EXPECT_NEAR(std::stod(period[3]), 1.4, 1e-10);
  EXPECT_LT(std::stod(period[15]), 1e-11);
  double before = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_GE(std::stod(lines[i][15]), before);  // until then: it does not fall
    before = std::stod(lines[i][15]);
  }
}

TEST_F(ReferenceCommand, EndsWhereNothingIsKnownAnyMore) {
  const Outcome outcome =
      run({"measure", scene("bouncing_balls.gltf"), "--reference", "a.csv", "--duration", "1"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("bouncing_balls: A1 of order "));
  EXPECT_THAT(outcome.out, HasSubstr("nothing is known, and written, of the 0.55 s after that\n"));
  EXPECT_NEAR(std::stod(table("a.csv").back()[0]), 0.45, 1e-9);  // the balls fall for 0.4515 s
}

TEST_F(ReferenceCommand, SaysWhyItIsNotTheIntegratorAndWritesNothingWithoutAReference) {
  const Outcome outcome = run({"measure", scene("short_chain.gltf"), "--reference", "a.csv"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("short_chain: no reference: A1 at h/"));
  EXPECT_THAT(outcome.err, HasSubstr("(not the own integrator: its joints are open at the start)"));
  EXPECT_THAT(outcome.err, HasSubstr("nothing is written\n"));
  EXPECT_TRUE(files().empty());
}

TEST_F(ReferenceCommand, NeverOverwritesItsScene) {
  write("scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string before = content("scene.obj");
  const Outcome outcome = run({"measure", "scene.obj", "--reference", "scene.obj"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(content("scene.obj"), before);
}

}  // namespace
}  // namespace substep
