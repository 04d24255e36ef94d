#include "render/video/titles.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "render/video/composition.h"
#include "sim/loading/load_scene.h"
#include "tests/folders.h"

namespace substep::render {
namespace {

std::vector<render::Run> runs_of(const std::vector<std::string>& panels) {
  Settings base = default_settings(Algorithm::a5);
  std::vector<render::Run> runs;
  for (const std::string& text : panels) runs.emplace_back().panel = panel_in(text, base);
  return runs;
}

using Words = std::vector<std::string>;

TEST(Titles, SayWhatDiffers) {
  const Titles titles = titles_of(runs_of({"a5,n=2", "a5,n=10"}));
  EXPECT_EQ(titles.words, (Words{"2 sub-steps", "10 sub-steps"}));
  EXPECT_EQ(titles.shared, "τ=0.6/0.9 · κ=1/0.7 · stable joints · 60 Hz");
}

TEST(Titles, NameAlgorithmsThatShareTheirSettings) {
  const Titles titles = titles_of(runs_of({"a1", "a3", "a5", "reference"}));
  EXPECT_EQ(titles.words, (Words{"all rows at once", "exact sub-steps", "as in Havok", ""}));
  EXPECT_EQ(titles.shared, "10 sub-steps · τ=0.6/0.9 · κ=1/0.7 · stable joints · 60 Hz");
}

TEST(Titles, SeparateIterationsOfStepsFromThoseOfSubSteps) {
  const Titles titles = titles_of(runs_of({"a2,m=25", "a5,n=25,m=1"}));
  EXPECT_EQ(titles.words, (Words{"25 iterations", "25 sub-steps"}));
  EXPECT_EQ(titles_of(runs_of({"a5,step=1/120", "a5,n=1,m=4"})).words,
            (Words{"10 sub-steps, 1 iteration, 120 Hz", "1 sub-step, 4 iterations, 60 Hz"}));
}

TEST(Titles, SaySettingsThatOthersHaveAtTheirDefault) {
  const Titles titles = titles_of(runs_of({"a1", "a5", "a5,warm_start=0.5"}));
  EXPECT_EQ(titles.words, (Words{"all rows at once", "as in Havok", "warm=0.5"}));
  EXPECT_EQ(titles.shared, "10 sub-steps · τ=0.6/0.9 · κ=1/0.7 · stable joints · 60 Hz");
}

TEST(Titles, TakeTheWordsGiven) {
  const Titles titles = titles_of(runs_of({"a5,n=2,title=two", "a5,n=10,title=ten"}));
  EXPECT_EQ(titles.words, (Words{"two", "ten"}));
}

TEST(Titles, PanelsOfOneAlgorithmDifferInShade) {
  const Scene scene = load_scene(std::string(test::source_folder) + "/scenes/pendulum.gltf");
  ComparisonSettings settings;
  settings.has_reference = false;
  settings.duration = 0;
  for (const render::Run& run : runs_of({"a5,n=2", "a4", "a5,n=10", "a5,n=20"}))
    settings.panels.push_back(run.panel);
  const Comparison comparison = simulate_comparison(scene, settings);
  std::vector<Color> colors;
  for (const render::Run& run : comparison.runs) colors.push_back(accent(run.panel));
  EXPECT_EQ(html_color(colors[0]), "#ff8a3d");
  for (std::size_t i = 0; i < colors.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      int difference = 0;
      for (std::size_t c = 0; c < 3; ++c) difference += std::abs(colors[i][c] - colors[j][c]);
      EXPECT_GT(difference, 120) << i << " and " << j;  // measured from 162
    }
  }
}

}  // namespace
}  // namespace substep::render
