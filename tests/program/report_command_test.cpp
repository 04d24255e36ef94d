#include <gmock/gmock.h>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class FigureCommand : public Program {};

TEST_F(FigureCommand, DrawsAPropertyWithoutASweep) {
  const Outcome outcome = run({"figure", "stability", "--output", "map.svg"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(content("map.svg"), HasSubstr("closed form"));
}

TEST_F(FigureCommand, RefusesWhatItCannotDraw) {
  expect_refused({"figure", "portrait"}, "there is no figure 'portrait'; there are work-rows");
  expect_refused({"figure", "work-rows"}, "'substep sweep' writes it");
  expect_refused({"figure", "stability", "--output", "map.png"}, "ends in .svg or .pdf");
}

class ReportCommand : public Program {};

TEST_F(ReportCommand, RefusesAMissingSweepFile) {
  expect_refused({"report", "nothing.toml"}, "nothing.toml");
}

}  // namespace
}  // namespace substep
