#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/image.h"
#include "render/renderer.h"
#include "render/text.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct SheetOptions {
  std::vector<fs::path> scenes;
  std::string size = "256x144";
  int columns = 6;
  fs::path output = "sheet.png";
  SolverOptions solver{Algorithm::a1};
};

/// The scene at its poster's time, or as near as it comes.
Image picture_of(const Scene& scene, const SolverOptions& solver, const ImageSize& size) {
  const Settings settings = solver.settings(scene);
  const double time = scene.poster.value_or(scene.duration / 2);
  const auto steps = static_cast<std::int64_t>(std::llround(time / settings.step));
  Simulation simulation(scene, settings);
  while (simulation.steps() < steps) {
    if (simulation.step().status == StepReport::Status::diverged) break;
  }
  RenderSettings render;
  render.width = size.width;
  render.height = size.height;
  render.steps_back = true;
  const std::vector<std::vector<Coordinates>> shown{initial_state(scene).q, simulation.state().q};
  return Renderer(scene, render, shown).draw(shown.back());
}

void draw_sheet(const SheetOptions& options) {
  constexpr int gap = 8;
  constexpr TextStyle label{.size = 16, .color = {70, 74, 82}, .bold = true};
  constexpr int label_height = 22;
  const ImageSize size = image_size_in(options.size);
  require_folder_of(options.output);
  std::vector<GivenFile> inputs;
  for (const fs::path& scene : options.scenes) inputs.push_back({"a scene", scene});
  require_separate_files(inputs, std::vector<GivenFile>{{"--output", options.output}});

  const int count = static_cast<int>(options.scenes.size());
  const int columns = std::min(options.columns, count);
  const int rows = (count + columns - 1) / columns;
  Image sheet(gap + columns * (size.width + gap), gap + rows * (size.height + label_height));
  std::fill(sheet.rgb.begin(), sheet.rgb.end(), std::uint8_t{255});
  Progress progress;
  for (int i = 0; i < count; ++i) {
    const Scene scene = load_scene(options.scenes[static_cast<std::size_t>(i)]);
    for (const std::string& warning : scene.warnings) fmt::print(stderr, "substep: note: {}\n", warning);
    const int x = gap + i % columns * (size.width + gap);
    const int y = gap + i / columns * (size.height + label_height);
    paste(sheet, picture_of(scene, options.solver, size), x, y);
    std::string name = scene.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    draw_text(sheet, x + 1, y + size.height + 14, name, label);
    progress.show("drawing", static_cast<double>(i + 1) / count);
  }
  write_png(sheet, options.output);
  fmt::print("wrote {}\n", options.output.string());
}

}  // namespace

void add_sheet_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand("sheet", "Draw a contact sheet: one picture of each scene");
  const auto options = std::make_shared<SheetOptions>();
  command.add_option("scenes", options->scenes, "Scene files, in the order of the sheet")->required();
  command.add_option("--size", options->size, "Width and height of one picture in pixels")
      ->capture_default_str();
  command.add_option("--columns", options->columns, "Pictures in a row")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  command.add_option("--output", options->output, "The .png file")->capture_default_str();
  options->solver.add_algorithm_to(command);
  options->solver.add_to(command);
  command.footer(
      "Each scene is drawn at the 'poster' time of its extras, or else at half its duration.\n"
      "Example:\n"
      "  substep sheet scenes/*.gltf --output sheet.png");
  command.callback([options] { draw_sheet(*options); });
}

}  // namespace substep::render
