#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/print_width.h"
#include "render/report/figures.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct FigureOptions {
  std::string name;
  fs::path results = "out/report";
  fs::path scenes = "scenes";
  std::vector<fs::path> problems;
  std::optional<fs::path> output;
  std::optional<std::string> width;
  std::optional<std::string> x_range;
  std::optional<std::string> y_range;
  std::vector<std::string> panels;
  std::vector<std::string> series;
  bool no_title = false;
  bool caption = false;
  bool no_caption = false;
  bool numbers = false;
  report::FigureStyle style;
};

report::PictureFormat format_of(const fs::path& output) {
  const std::string extension = output.extension().string();
  if (extension == ".svg") return report::PictureFormat::svg;
  if (extension == ".pdf") return report::PictureFormat::pdf;
  if (extension == ".png") return report::PictureFormat::png;
  throw Error(fmt::format("{}: give a name that ends in .svg, .pdf or .png", output.string()));
}

std::array<double, 2> range_in(const std::string& text, const char* option) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::optional<double> from = finite_number_in(std::string_view(text).substr(0, colon));
  const std::optional<double> to =
      finite_number_in(std::string_view(text).substr(std::min(colon + 1, text.size())));
  if (!from || !to || !(*from < *to)) {
    throw Error(fmt::format("{} '{}': give FROM:TO, the lesser first", option, text));
  }
  return {*from, *to};
}

void draw_figure(const FigureOptions& options) {
  const report::ReportFigure& figure = report::figure_named(options.name);
  const fs::path output = options.output.value_or(figure.name + ".svg");
  const report::PictureFormat format = format_of(output);
  report::FigureStyle style = options.style;
  if (options.width) style.width = print_width_in(*options.width);
  style.title = !options.no_title;
  // Leave out the caption, which the .txt file has: documents that print the figure have their own.
  style.caption = !options.no_caption && (!options.width || options.caption);
  // It stands between quotes in gnuplot's script.
  if (style.font.find_first_of("'\"\\\n,") != std::string::npos || style.font.empty()) {
    throw Error(fmt::format("--font '{}': give a font's name", style.font));
  }
  std::optional<std::array<double, 2>> x_range;
  std::optional<std::array<double, 2>> y_range;
  if (options.x_range) x_range = range_in(*options.x_range, "--x-range");
  if (options.y_range) y_range = range_in(*options.y_range, "--y-range");
  require_folder_of(output);
  report::FigureSource source;
  if (figure.from_sweep) source.records = read_records(options.results);
  source.scenes = options.scenes;
  source.problems = options.problems;
  const report::Sheet sheet =
      report::with_ranges(with_choice(figure.make(source), options.panels, options.series), x_range, y_range);
  if (options.numbers) {
    std::string text;
    for (const TextTable& table : report::numbers_of(sheet))
      text += (text.empty() ? "" : "\n") + to_markdown(table);
    fmt::print("{}", text);
    return;
  }
  const report::DrawnFigure drawn = report::drawn(sheet, format, style);
  for (const auto& [extension, content] :
       {std::pair(output.extension(), &drawn.picture), std::pair(fs::path(".csv"), &drawn.points),
        std::pair(fs::path(".txt"), &drawn.caption)}) {
    const fs::path file = fs::path(output).replace_extension(extension);
    write_file(file, *content);
    fmt::print("wrote {}\n", file.string());
  }
}

/// For print.
void add_style_options(CLI::App& command, FigureOptions& options) {
  command.add_option(
      "--width", options.width,
      "one-column (85 mm), two-columns (178 mm) or mm: a layout for print (as on the report's page)");
  command.add_option("--text", options.style.text, "Its text's size, points")
      ->check(CLI::Range(5.0, 14.0))
      ->capture_default_str();
  command.add_option("--font", options.style.font, "Its text's font, which has to be installed")
      ->capture_default_str();
  command.add_option("--panel", options.panels, "Only panels whose title begins so; once for each")
      ->allow_extra_args(false);
  command.add_option("--series", options.series, "Only series whose title begins so; once for each")
      ->allow_extra_args(false);
  command.add_option("--x-range", options.x_range, "FROM:TO, of all panels' x axes");
  command.add_option("--y-range", options.y_range, "FROM:TO, of all panels' y axes");
  command.add_flag("--no-title", options.no_title, "For a figure that the document titles");
  command.add_flag("--caption", options.caption, "Draw the caption with --width too");
  command.add_flag("--no-caption", options.no_caption, "For a figure that the document captions");
  command.add_flag("--transparent", options.style.transparent, "No white ground");
  command.add_option("--dpi", options.style.dpi, "Pixels in an inch of a .png")
      ->check(CLI::Range(50.0, 2400.0))
      ->capture_default_str();
}

}  // namespace

void add_figure_command(CLI::App& report) {
  CLI::App* const command =
      report.add_subcommand("figure", "Draw a figure of a sweep's results, or of a property");
  const auto options = std::make_shared<FigureOptions>();
  std::string about = "Which one:";
  for (const report::ReportFigure& figure : report::figures()) {
    about += fmt::format("\n  {:<22}{}{}{}", figure.name, figure.about, figure.from_sweep ? " [sweep]" : "",
                         figure.reproducible ? "" : " [times]");
  }
  command->add_option("name", options->name, about)->required();
  command->add_option("--results", options->results, "Folder of the sweep's results")->capture_default_str();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  command
      ->add_option("--problem", options->problems,
                   "A friction problem's file, as 'mlcp' reads; once for each")
      ->allow_extra_args(false);
  command->add_option(
      "--output", options->output,
      "The picture, .svg, .pdf or .png (NAME.svg); beside it the points as .csv and the caption as .txt");
  command->add_flag("--numbers", options->numbers, "Print its numbers as Markdown instead, a table a panel");
  add_style_options(*command, *options);
  command->footer(
      "[sweep]: 'substep sweep' must have been run before. [times]: differs from run to run; the others are "
      "the same\n"
      "to the last byte.\n"
      "Example:\n  substep report figure work-rows --results results --output work.pdf\n"
      "  substep report figure stability --width one-column --no-title --output stability.pdf");
  command->callback([options] { draw_figure(*options); });
}

}  // namespace substep::render
