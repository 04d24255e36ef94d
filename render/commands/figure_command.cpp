#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "render/commands/commands.h"
#include "render/report/figures.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct FigureOptions {
  std::string name;
  fs::path results = "out/sweep";
  fs::path scenes = "scenes";
  std::optional<fs::path> output;
};

void draw_figure(const FigureOptions& options) {
  const ReportFigure& figure = figure_named(options.name);
  const fs::path output = options.output.value_or(figure.name + ".svg");
  const std::string extension = output.extension().string();
  if (extension != ".svg" && extension != ".pdf") {
    throw Error(fmt::format("{}: give a name that ends in .svg or .pdf", output.string()));
  }
  require_folder_of(output);
  FigureSource source;
  if (figure.from_sweep) source.records = read_records(options.results);
  source.scenes = options.scenes;
  write_file(output,
             draw(figure.make(source), extension == ".svg" ? PictureFormat::svg : PictureFormat::pdf));
  fmt::print("wrote {}\n", output.string());
}

}  // namespace

void add_figure_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("figure", "Draw a figure of a sweep's results, or of a property");
  const auto options = std::make_shared<FigureOptions>();
  std::string about = "Which one:";
  for (const ReportFigure& figure : figures()) {
    about += fmt::format("\n  {:<20}{}{}{}", figure.name, figure.about, figure.from_sweep ? " [sweep]" : "",
                         figure.reproducible ? "" : " [times]");
  }
  command->add_option("name", options->name, about)->required();
  command->add_option("--results", options->results, "Folder of the sweep's results")->capture_default_str();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  command->add_option("--output", options->output, "The picture, .svg or .pdf (NAME.svg)");
  command->footer(
      "[sweep]: 'substep sweep' must have been run before. [times]: differs from run to run; the others are "
      "the same\n"
      "to the last byte.\n"
      "Example:\n  substep figure work-rows --results results --output work.pdf");
  command->callback([options] { draw_figure(*options); });
}

}  // namespace substep
