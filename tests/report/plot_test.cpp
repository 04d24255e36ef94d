#include "render/report/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace substep {
namespace {

using testing::HasSubstr;
using testing::Not;

Sheet sheet_of(std::vector<std::array<double, 2>> points) {
  Sheet sheet;
  sheet.title = "title's";
  sheet.caption = {"a caption"};
  Panel panel;
  panel.title = "under_score";
  panel.x = {"x", true, {}, {}};
  panel.y = {"y", true, {}, {}};
  panel.series = {{"one", {2, 7, false, true, true}, std::move(points)}};
  panel.triangles = {{1, 1, 3, 1}};
  sheet.panels = {panel, panel};
  return sheet;
}

TEST(Plot, HasItsWords) {
  const std::string svg = draw(sheet_of({{1, 1}, {10, 0.1}}), PictureFormat::svg);
  for (const char* const text : {"title's", "under_score", "a caption", "one"})
    EXPECT_THAT(svg, HasSubstr(text));
}

TEST(Plot, LeavesOutWhatAnAxisCannotShow) {
  const std::string with = draw(sheet_of({{1, 1}, {10, 0.1}, {5, NAN}, {0, 1}, {3, -1}}), PictureFormat::svg);
  EXPECT_EQ(with, draw(sheet_of({{1, 1}, {10, 0.1}}), PictureFormat::svg));
  EXPECT_THAT(with, Not(HasSubstr("nan")));
}

TEST(Plot, DrawsAPanelWithoutPoints) {
  EXPECT_THAT(draw(sheet_of({}), PictureFormat::svg), HasSubstr("under_score"));
}

}  // namespace
}  // namespace substep
