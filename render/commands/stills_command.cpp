#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/comparison_options.h"
#include "render/commands/print_width.h"
#include "render/video/time_sheet.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct StillsOptions {
  ComparisonOptions comparison;
  std::vector<std::string> times;
  std::string size = "640x360";
  std::optional<std::string> width;
  double dpi = 300;
  double text = 8;
  std::string camera = "scene";
  std::optional<fs::path> output;
};

std::vector<double> times_in(const std::vector<std::string>& typed, double duration) {
  std::vector<double> times;
  for (const std::string& text : typed) {
    const double time = seconds_in(text, "--time");
    if (!(time >= 0 && time <= duration + 1e-9)) {
      throw Error(fmt::format(
          "--time '{}': must be from 0 to the end of the run, {:g} s (--duration makes it longer)", text,
          duration));
    }
    times.push_back(time);
  }
  std::ranges::sort(times);
  return times;
}

/// For print, all pictures together have the width, and `size` their shape.
void set_size(const StillsOptions& options, TimeSheetSettings& sheet) {
  const ImageSize size = image_size_in(options.size);
  sheet.width = size.width;
  sheet.height = size.height;
  if (!options.width) return;
  constexpr double inch = 25.4;  // mm
  constexpr double points = 72;  // in an inch
  sheet.text = options.text / points * options.dpi;
  const auto columns = static_cast<double>(sheet.times.size());
  const double all = print_width_in(*options.width) / inch * options.dpi;
  const double gaps = gap_of(sheet) * (columns + 1);
  sheet.width = static_cast<int>(std::floor((all - gaps) / columns));
  if (sheet.width < 16)
    throw Error(fmt::format("--width {}: leaves no room for {} pictures", *options.width, columns));
  sheet.height = static_cast<int>(std::lround(static_cast<double>(sheet.width) * size.height / size.width));
}

void draw_stills(StillsOptions& options) {
  ComparisonOptions& typed = options.comparison;
  const Scene scene = typed.scene.load();
  TimeSheetSettings sheet;
  sheet.comparison = typed.settings(scene);
  sheet.title = typed.title;
  sheet.times = times_in(options.times, sheet.comparison.duration);
  set_size(options, sheet);
  sheet.camera = still_camera_named(options.camera, scene);
  const fs::path output = options.output.value_or(scene.name + ".png");
  if (output.extension() != ".png")
    throw Error(fmt::format("{}: give a name that ends in .png", output.string()));
  typed.scene.require_separate({{"--output", output}});
  require_folder_of(output);
  TimeSheet drawn;
  {
    Progress progress;
    sheet.progress = [&progress](std::string_view stage, double share) { progress.show(stage, share); };
    drawn = draw_time_sheet(scene, sheet);
  }
  write_png(drawn.image, output);
  print_table(drawn.comparison);
  fmt::print("wrote {}: {}x{} pixels\n", output.string(), drawn.image.width, drawn.image.height);
}

}  // namespace

void add_stills_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "stills", "Draw runs below each other at chosen times, as one picture for a page or for print");
  const auto options = std::make_shared<StillsOptions>();
  options->comparison.add_runs_to(*command);
  command->add_option("--time", options->times, "Seconds into the run, comma-separated: the columns")
      ->delimiter(',')
      ->required();
  command->add_option("--size", options->size, "Width and height of each picture in pixels")
      ->capture_default_str();
  command->add_option(
      "--width", options->width,
      "For print, of all: one-column (85 mm), two-columns (178 mm) or mm; --size is the pictures' "
      "shape then");
  command->add_option("--dpi", options->dpi, "Pixels in an inch of print")
      ->check(CLI::Range(50.0, 2400.0))
      ->needs("--width")
      ->capture_default_str();
  command->add_option("--text", options->text, "Text's size in print, points")
      ->check(CLI::Range(4.0, 24.0))
      ->needs("--width")
      ->capture_default_str();
  command
      ->add_option("--camera", options->camera,
                   "scene (its first), fit (all that moves) or name:CAMERA, another of the scene's")
      ->capture_default_str();
  command->add_option("--output", options->output, "The picture (SCENE.png)");
  command->footer(
      "Panels are those of 'substep video', whose help says how they are given; each is a row. In each "
      "picture stands "
      "its error, as films have it, where there is a reference.\n"
      "Example:\n"
      "  substep stills scenes/top_heavy_stack.gltf --panel a5,n=1 --panel a5,n=16 --time 0,0.5,1\n"
      "  substep stills scenes/card_house.gltf --panel a5 --time 0,5 --no-reference --width two-columns "
      "--dpi 600");
  command->callback([options] { draw_stills(*options); });
}

}  // namespace substep::render
