#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/comparison_options.h"
#include "render/player/player_page.h"
#include "render/site/site.h"
#include "sim/commands/progress.h"
#include "sim/error.h"

namespace substep::render {
namespace {

struct SiteOptions {
  ComparisonOptions comparison;
  SiteSettings site;
};

void make(SiteOptions& options) {
  SiteSettings& site = options.site;
  site.frame_rate = options.comparison.frame_rate;
  site.speed = options.comparison.speed;
  Progress progress;
  site.progress = [&progress](std::string_view stage, double share) { progress.show(stage, share); };
  site.comparison = [&options](const Scene& scene) {
    // What settings() finds for one scene is not the next one's.
    ComparisonOptions typed = options.comparison;
    ComparisonSettings settings = typed.settings(scene);
    settings.readings = player_readings(scene);
    return settings;
  };
  site.failure = [&progress](const std::filesystem::path& scene, std::string_view why) {
    progress.clear();
    const std::string name = scene.string();
    fmt::print(stderr, "substep: {}{}\n", why.starts_with(name) ? "" : name + ": ", why);
  };
  const int made = make_site(site);
  progress.clear();
  fmt::print("wrote {}: {} of {} scenes\n", (site.folder / "index.html").string(), made, site.scenes.size());
  if (static_cast<std::size_t>(made) < site.scenes.size()) {
    throw Error(
        fmt::format("{} scenes could not be shown", site.scenes.size() - static_cast<std::size_t>(made)));
  }
}

}  // namespace

void add_site_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("site", "Write a folder of pages, one a scene, for a web server");
  const auto options = std::make_shared<SiteOptions>();
  command->add_option("scenes", options->site.scenes, "Scene files, in the order of the index")->required();
  options->site.folder = "site";
  command->add_option("--output", options->site.folder, "The folder")->capture_default_str();
  command->add_option("--title", options->site.title, "Of the index")->capture_default_str();
  command->add_flag("--films", options->site.films, "Also film each scene");
  options->comparison.add_settings_to(*command);
  command->footer(
      "A page has the text of the Markdown file beside the scene, its player, its film where asked for, and "
      "a "
      "table of\n"
      "the errors. Panels are those of 'substep video'. A scene that cannot be shown is named, and the "
      "others "
      "are done.\n"
      "Example:\n  substep site scenes/*.gltf --output site");
  command->callback([options] { make(*options); });
}

}  // namespace substep::render
