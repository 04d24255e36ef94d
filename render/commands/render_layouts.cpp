#include "render/commands/render_layouts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/image.h"
#include "render/renderer.h"
#include "render/text.h"
#include "render/video/composition.h"
#include "render/video/time_sheet.h"
#include "sim/error.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// Returns a picture of the scene at its poster's time, by default half its duration, or when it diverges.
Image picture_of(const Scene& scene, const SolverOptions& solver, const RenderSettings& render) {
  const Settings settings = solver.settings(scene);
  const double time = scene.poster.value_or(scene.duration / 2);
  const std::int64_t steps = std::llround(time / settings.step);
  Simulation simulation(scene, settings);
  while (simulation.steps() < steps && simulation.step().status != StepReport::Status::diverged) {
  }
  const std::vector<std::vector<Coordinates>> shown{initial_state(scene).q, simulation.state().q};
  return Renderer(scene, render, shown).draw(shown.back());
}

constexpr double inch = 25.4;  // mm

/// Returns the times of --time, sorted. Throws Error where one is outside the run.
std::vector<double> times_in(const std::vector<std::string>& typed, double duration) {
  std::vector<double> times;
  for (const std::string& text : typed) {
    const double time = seconds_in(text, "--time");
    if (!(time >= 0 && time <= duration + 1e-9)) {
      throw Error("--time '{}': must be from 0 to the end of the run, {:g} s (--duration makes it longer)",
                  text, duration);
    }
    times.push_back(time);
  }
  std::ranges::sort(times);
  return times;
}

/// Sets the size of each picture; with --width from the columns and --size's aspect ratio. Scales the text.
void set_size(const RenderOptions& options, TimeSheetSettings& sheet) {
  const ImageSize size = image_size_in(options.size.value_or("640x360"));
  sheet.width = size.width;
  sheet.height = size.height;
  if (!options.width) return;
  constexpr double points = 72;  // in an inch
  sheet.text = options.text / points * options.dpi;
  const auto columns = static_cast<double>(sheet.times.size());
  const double total_width = print_width_in(*options.width) / inch * options.dpi;
  const double gaps = gap_of(sheet) * (columns + 1);
  sheet.width = static_cast<int>(std::floor((total_width - gaps) / columns));
  if (sheet.width < 16) throw Error("--width {}: leaves no room for {} pictures", *options.width, columns);
  sheet.height = static_cast<int>(std::lround(static_cast<double>(sheet.width) * size.height / size.width));
}

}  // namespace

void draw_sheet(const RenderOptions& options) {
  constexpr int gap = 8;
  constexpr TextStyle label{.size = 16, .color = {70, 74, 82}, .bold = true};
  constexpr int label_height = 22;
  const ImageSize size = image_size_in(options.size.value_or("256x144"));
  const RenderSettings render{.width = size.width, .height = size.height, .steps_back = true};
  check(render);
  const fs::path output = options.output.value_or("sheet.png");
  require_folder_of(output);
  std::vector<GivenFile> inputs;
  for (const fs::path& scene : options.inputs) inputs.push_back({"a scene", scene});
  require_separate_files(inputs, std::vector<GivenFile>{{"--output", output}});
  if (output.extension() != ".png") throw Error("{}: give a name that ends in .png", output.string());

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
    paste(sheet, picture_of(scene, options.run.solver, render), x, y);
    draw_text(sheet, x + 1, y + size.height + 14, cut(film_title(scene, ""), label, size.width - 2), label);
    progress.show("drawing", static_cast<double>(i + 1) / count);
  }
  write_png(sheet, output);
  fmt::print("wrote {}\n", output.string());
}

void draw_stills(const RenderOptions& options) {
  ComparisonOptions typed = options.comparison;
  typed.scene = options.run.mesh;
  typed.scene.file = options.run.file;
  typed.solver = options.run.solver;
  const Scene scene = typed.scene.load();
  TimeSheetSettings sheet;
  sheet.comparison = typed.settings(scene);
  sheet.title = typed.title;
  if (options.times.empty()) throw Error("--layout stills: give the columns' times, such as --time 0,0.5,1");
  sheet.times = times_in(options.times, sheet.comparison.duration);
  set_size(options, sheet);
  sheet.camera = still_camera_named(options.camera, scene);
  const fs::path output = options.output.value_or(scene.name + ".png");
  const bool is_pdf = output.extension() == ".pdf";
  if (output.extension() != ".png" && !is_pdf)
    throw Error("{}: give a name that ends in .png or .pdf", output.string());
  typed.scene.require_separate({{"--output", output}});
  require_folder_of(output);
  Progress progress;
  sheet.progress = [&progress](std::string_view stage, double fraction) { progress.show(stage, fraction); };
  const TimeSheet drawn = draw_time_sheet(scene, sheet);
  progress.clear();
  const double width =
      options.width ? print_width_in(*options.width) : drawn.image.width / options.dpi * inch;
  write_file(output, is_pdf ? to_pdf(drawn.image, width) : to_png(drawn.image));
  print_table(drawn.comparison);
  fmt::print("wrote {}: {}x{} pixels, {:.1f} mm wide at {:.0f} pixels an inch\n", output.string(),
             drawn.image.width, drawn.image.height, width, drawn.image.width / width * inch);
}

}  // namespace substep::render
