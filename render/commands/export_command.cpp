#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "render/animated_glb.h"
#include "render/commands/commands.h"
#include "render/commands/options.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  RunInput run;
  std::optional<fs::path> output;
  double rate = 60;
};

void export_run(const ExportOptions& options) {
  if (options.output) {
    if (options.output->extension() != ".glb")
      throw Error("{}: give a name that ends in .glb", options.output->string());
    require_folder_of(*options.output);
    options.run.require_separate(*options.output);
  }
  Progress progress;
  const LoadedRun run = options.run.load({}, progress);
  const PoseLog& log = run.log;
  // Choose keys at steps whose poses the log has, as near to the rate as possible.
  const double spacing = log.settings.step * log.full_every;
  const int every = log.full_every * std::max(1, static_cast<int>(std::lround(1 / (options.rate * spacing))));
  std::vector<std::vector<Coordinates>> frames;
  for (std::size_t k = 0; k < log.frames.size(); k += static_cast<std::size_t>(every)) {
    if (!log.frames[k].poses.empty()) frames.push_back(log.frames[k].poses);
  }
  const fs::path output = options.output.value_or(run.stem + ".glb");
  const double interval = log.settings.step * every;
  write_file(output, animated_glb(run.scene, frames, interval));
  fmt::print("wrote {}: {} frames, {:g} s apart, the last at {:g} s\n", output.string(), frames.size(),
             interval, static_cast<double>(frames.size() - 1) * interval);
  if (log.end != "ok") fmt::print("the run ended \"{}\"\n", log.end);
}

}  // namespace

void add_export_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("export", "Write a run as an animated .glb, for Blender and viewers on the web");
  const auto options = std::make_shared<ExportOptions>();
  command
      ->add_option("input", options->run.file,
                   "A pose log or table, or a scene or mesh, which is simulated first")
      ->required();
  options->run.add_options_to(*command);
  command->add_option("--output", options->output, "The .glb file (SCENE.ALGORITHM.glb)");
  command->add_option("--rate", options->rate, "Poses in a second, as near as steps or full frames allow")
      ->check(number_from(0.1, 100000))
      ->capture_default_str();
  command->footer(
      "The file holds bodies with what is drawn of them, the ground, the scene's camera and sun.\n"
      "Example:\n  substep export scenes/ragdoll.gltf --algorithm a5 --output ragdoll.glb");
  command->callback([options] { export_run(*options); });
}

}  // namespace substep::render
