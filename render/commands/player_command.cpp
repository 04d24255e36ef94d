#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "render/commands/commands.h"
#include "render/commands/comparison_options.h"
#include "render/player/player_page.h"
#include "render/video/composition.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct PlayerOptions {
  ComparisonOptions comparison;
  std::optional<fs::path> output;
};

void make_player(PlayerOptions& options) {
  ComparisonOptions& typed = options.comparison;
  const Scene scene = typed.scene.load();
  ComparisonSettings settings = typed.settings(scene);
  settings.readings = player_readings(scene);
  const fs::path output = options.output.value_or(scene.name + ".html");
  if (output.extension() != ".html") {
    throw Error(fmt::format("{}: give a name that ends in .html", output.string()));
  }
  typed.scene.require_separate({{"--output", output}});
  require_folder_of(output);
  Comparison comparison;
  {
    Progress progress;
    comparison = simulate_comparison(scene, settings,
                                     [&progress](double share) { progress.show("simulating", share); });
  }
  const std::string page = player_page(scene, comparison, film_title(scene, typed.title), typed.speed);
  write_file(output, page);
  print_table(comparison);
  warn_of(scene, comparison);
  fmt::print("wrote {}: {:.2g} MB\n", output.string(), static_cast<double>(page.size()) / 1e6);
}

}  // namespace

void add_player_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "player", "Write the panels of a film as one page to play, turn and measure in a browser");
  const auto options = std::make_shared<PlayerOptions>();
  options->comparison.frame_rate = 60;
  options->comparison.add_to(*command);
  command->add_option("--output", options->output, "The page (SCENE.html)");
  command->footer(
      "Panels are those of 'substep video', whose help says how they are given. The page needs no network "
      "and no\n"
      "other file, but a browser with WebGL 2. Its positions are good to a few millionths of the scene's "
      "size, "
      "its\n"
      "turns to 3e-5 rad.\n"
      "Example:\n  substep player scenes/heavy_chain.gltf --panel a5,n=4 --panel bullet --output chain.html");
  command->callback([options] { make_player(*options); });
}

}  // namespace substep::render
