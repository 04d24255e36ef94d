#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/options.h"
#include "render/player/player_page.h"
#include "render/site/site.h"
#include "render/video/composition.h"
#include "sim/commands/output.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct PlayerOptions {
  ComparisonOptions comparison;
  std::vector<fs::path> scenes;
  std::optional<fs::path> output;
  bool films = false;
  bool has_frame_rate = false;  ///< --fps was typed
};

/// Writes a page of one scene.
void make_page(PlayerOptions& options) {
  ComparisonOptions& typed = options.comparison;
  typed.scene.file = options.scenes.front();
  const Scene scene = typed.scene.load();
  ComparisonSettings settings = typed.settings(scene);
  settings.quantities = player_quantities(scene);
  const fs::path output = options.output.value_or(scene.name + ".html");
  if (output.extension() != ".html") throw Error("{}: give a name that ends in .html", output.string());
  typed.scene.require_separate({{"--output", output}});
  require_folder_of(output);
  Progress progress;
  const Comparison comparison = simulate_comparison(
      scene, settings, [&progress](double fraction) { progress.show("simulating", fraction); });
  progress.clear();
  const std::string page = player_page(scene, comparison, film_title(scene, typed.title), typed.speed);
  write_file(output, page);
  print_table(comparison, settings.duration);
  warn_of(scene, comparison);
  fmt::print("wrote {}: {:.2g} MB\n", output.string(), static_cast<double>(page.size()) / 1e6);
}

/// Writes a folder with a page for each scene.
void make_pages(PlayerOptions& options) {
  SiteSettings site;
  site.scenes = options.scenes;
  site.folder = options.output.value_or("site");
  if (!options.comparison.title.empty()) site.title = options.comparison.title;
  site.films = options.films;
  if (!options.has_frame_rate) options.comparison.frame_rate = site.frame_rate;
  site.frame_rate = options.comparison.frame_rate;
  site.speed = options.comparison.speed;
  Progress progress;
  site.progress = [&progress](std::string_view stage, double fraction) { progress.show(stage, fraction); };
  site.load = [&](const fs::path& file) {
    progress.clear();
    return options.comparison.scene.load(file);
  };
  site.comparison = [&options](const Scene& scene) {
    ComparisonSettings settings = options.comparison.settings(scene);
    settings.quantities = player_quantities(scene);
    return settings;
  };
  site.failure = [&progress](const fs::path& scene, std::string_view why) {
    progress.clear();
    const std::string name = scene.string();
    fmt::print(stderr, "substep: {}{}\n", why.starts_with(name) ? "" : name + ": ", why);
  };
  const int made = make_site(site);
  progress.clear();
  fmt::print("wrote {}: {} of {} scenes\n", (site.folder / "index.html").string(), made, site.scenes.size());
  const std::size_t failed = site.scenes.size() - static_cast<std::size_t>(made);
  if (failed > 0) throw Error("{} scene{} could not be shown", failed, failed == 1 ? "" : "s");
}

}  // namespace

void add_player_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "player", "Write the panels of a film as one page to play, turn and measure in a browser");
  const auto options = std::make_shared<PlayerOptions>();
  ComparisonOptions& comparison = options->comparison;
  comparison.frame_rate = 60;
  command->add_option("scenes", options->scenes, "A scene or mesh; several make a folder of pages")
      ->required();
  comparison.scene.add_mesh_options_to(*command);
  command->add_option("--title", comparison.title,
                      "Title of the page (the scene's name; of a folder of pages: Scenes)");
  comparison.add_settings_to(*command);
  command->get_option("--fps")->default_str("60; in a folder of pages 30");
  command->add_option("--output", options->output,
                      "The page (SCENE.html), or the folder of pages, one a scene (site)");
  command->add_flag("--films", options->films, "In a folder of pages: also film each scene");
  command->footer(
      "Panels are those of 'substep video', whose help says how they are given. A page needs no network and "
      "no other file, but a browser with WebGL 2. Its positions are good to a few millionths of the scene's "
      "size, its turns to 3e-5 rad.\n"
      "A folder of pages is made for a web server. There each scene also has the text of the Markdown file "
      "beside it and a table of the errors. A scene that cannot be shown is named, and the others are done.\n"
      "Example:\n  substep player scenes/heavy_chain.gltf --panel a5,n=4 --panel bullet --output chain.html\n"
      "  substep player scenes/*.gltf --output site");
  command->callback([options, command] {
    options->has_frame_rate = command->count("--fps") > 0;
    if (options->scenes.size() > 1 || (options->output && !options->output->has_extension()))
      return make_pages(*options);
    if (options->films) throw Error("--films: only with a folder of pages");
    make_page(*options);
  });
}

}  // namespace substep::render
