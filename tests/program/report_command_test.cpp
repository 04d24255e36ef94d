#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "program.h"

namespace substep {
namespace {

using testing::HasSubstr;

class FigureCommand : public Program {};

TEST_F(FigureCommand, DrawsStabilityMapWithoutASweep) {
  printed("report figure stability --output map.svg");
  EXPECT_THAT(content("map.svg"), HasSubstr("closed form"));
  // Each algorithm is a panel of stable and unstable points, and of the closed form.
  EXPECT_THAT(content("map.csv"),
              testing::StartsWith("panel,series,x_axis,y_axis,x,y,value\n\"A3\",\"stable\",\"κ\",\"τ\","));
  EXPECT_THAT(content("map.txt"), testing::StartsWith("Stability of one constraint row"));
}

TEST_F(FigureCommand, DrawsOverlapsOfSweepsAndSubsteps) {
  printed("report figure drift --scenes $S --output drift.svg");
  for (const char* const algorithm : {"A2", "A3", "A4", "A5"})
    EXPECT_THAT(content("drift.csv"), HasSubstr(std::string("contacts\",\"") + algorithm));
  expect("report figure drift --scenes $S --numbers", 0,
         {"| rod_chain: energy: t, s | A1 | A2 | A3 | A4 | A5 |"});
}

TEST_F(FigureCommand, RefusesBadOptions) {
  for (const auto& [words, message] :
       {std::pair("portrait", "there is no figure 'portrait'; there are work-rows"),
        {"work-rows", "'substep sweep' writes it"},
        {"stability --output map.eps", "ends in .svg, .pdf or .png"},
        {"stability --width wide", "give one-column (85 mm), two-columns"},
        {"stability --width 5", "--width '5'"},
        {"stability --x-range 2:1", "--x-range '2:1': give FROM:TO"},
        {"stability --series A9", "no series 'A9': it has stable; unstable; closed form"},
        {"stability --x-range 5:6", "no point of the panel 'A3' lies in the range"},
        {"stability --caption --no-caption", "excludes"},
        {"stability --font Nonsense", "--font 'Nonsense': is not installed"},
        {"stability --font \"a'b\"", "--font 'a'b': give a font's name"}})
    refuses(std::string("report figure ") + words, message);
}

class ReportCommand : public Program {};

TEST_F(ReportCommand, MakesAPageOfASweepFile) {
  std::filesystem::create_directory(folder() / "mine");
  copy_scene("pendulum.gltf", "mine/swing.gltf");
  copy_scene("sliding_ball.gltf", "mine/ball.gltf");
  write("mine/my.toml",
        "horizon = 0.1\n[[grid]]\nscenes = [\"swing.gltf\", \"ball.gltf\"]\n"
        "algorithms = [\"a1\", \"a5\"]\nsubsteps = [1, 4]\n");
  printed("report mine/my.toml --output page");
  expect_content("page/report.md", {"6 runs of 2 scenes", "### swing"},
                 {"heavy_chain", "box_stack", "figures/stability.svg", "figures/drift.svg", "engines"});
}

TEST_F(ReportCommand, MakesAPageOfScenes) {
  copy_scene("pendulum.gltf", "swing.gltf");
  copy_scene("sliding_ball.gltf", "ball.gltf");
  printed("report swing.gltf ball.gltf --output page");
  const std::string page = content("page/report.md");
  // A1 at four steps, A2 with six numbers of iterations, A3 to A5 with six of sub-steps each.
  EXPECT_THAT(page, HasSubstr("56 runs of 2 scenes"));
  // The page begins with the answers, a card for each scene.
  EXPECT_THAT(page.substr(0, 600),
              HasSubstr("### swing\n\n| for | take | ms of CPU a simulated second | RMS error / size |"));
  EXPECT_LT(page.find("### ball"), page.find("## At equal cost"));
  for (const char* const file : {"choice-swing.svg", "choice-swing.csv", "end-swing.png", "end-ball.png"})
    EXPECT_TRUE(has(std::string("page/figures/") + file)) << file;
  EXPECT_THAT(content("page/figures/choice-swing.csv"), HasSubstr("\"chosen\""));
  EXPECT_THAT(content("page/report.html"), HasSubstr("<section class=\"card\">\n<h3>swing</h3>"));
  // A figure is drawn from the same folder.
  printed("report figure work-rows --results page");
}

TEST_F(ReportCommand, MapsAScene) {
  copy_scene("pendulum.gltf", "swing.gltf");
  printed("report swing.gltf --maps --output page");
  // The first map has A3 and A5 at four steps with four n, the second at five τ with five κ.
  const std::string steps = content("page/figures/map-steps.csv");
  EXPECT_EQ(std::ranges::count(steps, '\n'), 1 + 2 * 4 * 4 + 2 * 2);  // and two n more at h
  EXPECT_THAT(steps, HasSubstr("\"swing: A3\",\"error or gap below 1 % of the size\",\"n\",\"h, s\",20,"));
  const std::string factors = content("page/figures/map-factors.csv");
  EXPECT_EQ(std::ranges::count(factors, '\n'), 1 + 2 * 5 * 5);
  // τ = 1.8 lies above 4 − 2κ at κ = 1.6 alone, where a row is unstable.
  EXPECT_THAT(factors, HasSubstr("\"not bounded\",\"κ\",\"τ\",1.6,1.8,"));
  EXPECT_THAT(content("page/report.md"), HasSubstr("(<figures/map-factors.svg>)"));
}

TEST_F(ReportCommand, PrintsOneTable) {
  copy_scene("box_stack.gltf", "pile.gltf");
  write(
      "my.toml",
      "horizon = 0.1\nparts = false\n[[grid]]\nscenes = [\"pile.gltf\"]\nalgorithms = [\"a5\", \"soft\"]\n"
      "substeps = [6, 16]\ntau = [0.6]\ncontact_tau = [0.9]\ncontact_kappa = [0.7]\njoints = [\"stable\"]\n");
  expect("report my.toml --output page --table descendants-rows", 0,
         {"| displacement, m | pile |", "\n| Soft Step | 0.028"});
  EXPECT_FALSE(has("page/report.md"));
  // The sweep has no repetitions.
  refuses("report my.toml --output page --table descendants-time",
          "the table descendants-time has nothing to show: the sweep measured none of it");
}

TEST_F(ReportCommand, RefusesMissingAndMixedInputs) {
  refuses("report nothing.toml", "nothing.toml");
  refuses("report nothing.gltf", "nothing.gltf");
  refuses("report --table chairs", "--table 'chairs': give descendants-rows or descendants-time");
  write("one.toml", "");
  refuses("report one.toml --maps", "--maps: give scenes");
  refuses("report one.toml two.toml", "two.toml: give one sweep file, or scenes");
  refuses("report claims --scenes nowhere", "nowhere");
  refuses("report claims --scenes $S --output nowhere/claims.md", "nowhere");
}

}  // namespace
}  // namespace substep
