#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "render/commands/render_options.h"
#include "render/image.h"
#include "render/renderer.h"
#include "render/text.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

void draw_sheet(const RenderOptions& options) {
  constexpr int gap = 8;
  constexpr TextStyle label{.size = 16, .color = {70, 74, 82}, .bold = true};
  constexpr int label_height = 22;
  const ImageSize size = image_size_in(options.size.value_or("256x144"));
  const fs::path output = options.output.value_or("sheet.png");
  require_folder_of(output);
  std::vector<GivenFile> inputs;
  for (const fs::path& scene : options.inputs) inputs.push_back({"a scene", scene});
  require_separate_files(inputs, std::vector<GivenFile>{{"--output", output}});

  const int count = static_cast<int>(options.inputs.size());
  const int columns = std::min(options.columns, count);
  const int rows = (count + columns - 1) / columns;
  Image sheet(gap + columns * (size.width + gap), gap + rows * (size.height + label_height));
  std::fill(sheet.rgb.begin(), sheet.rgb.end(), std::uint8_t{255});
  Progress progress;
  for (int i = 0; i < count; ++i) {
    const Scene scene = options.run.mesh.load(options.inputs[static_cast<std::size_t>(i)]);
    const int x = gap + i % columns * (size.width + gap);
    const int y = gap + i / columns * (size.height + label_height);
    paste(sheet, picture_of(scene, options.run.solver, size), x, y);
    std::string name = scene.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    draw_text(sheet, x + 1, y + size.height + 14, name, label);
    progress.show("drawing", static_cast<double>(i + 1) / count);
  }
  write_png(sheet, output);
  fmt::print("wrote {}\n", output.string());
}

}  // namespace substep::render
