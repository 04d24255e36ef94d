#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/options.h"
#include "render/report/figures.h"
#include "render/report/report.h"
#include "render/video/time_sheet.h"
#include "sim/commands/commands.h"
#include "sim/error.h"
#include "sim/execution/child_process.h"
#include "sim/log/file_output.h"
#include "sim/model/usual_settings.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// Prints the tables. Throws Error where there are none. `what`: their name.
void print(const std::vector<TextTable>& tables, const std::string& what) {
  if (tables.empty()) throw Error("{} has nothing to show: the sweep measured none of it", what);
  const char* between = "";
  for (const TextTable& table : tables) fmt::print("{}{}", std::exchange(between, "\n"), to_markdown(table));
}

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
  throw Error("{}: give a name that ends in .svg, .pdf or .png", output.string());
}

/// Reads FROM:TO; nothing where it was not typed. Throws Error.
std::optional<std::array<double, 2>> range_in(const std::optional<std::string>& text, const char* option) {
  if (!text) return std::nullopt;
  const std::size_t colon = std::min(text->find(':'), text->size());
  const std::optional<double> from = finite_number_in(std::string_view(*text).substr(0, colon));
  const std::optional<double> to =
      finite_number_in(std::string_view(*text).substr(std::min(colon + 1, text->size())));
  if (!from || !to || !(*from < *to)) throw Error("{} '{}': give FROM:TO, the lesser first", option, *text);
  return std::array{*from, *to};
}

/// Returns true where fontconfig lists the font, or cannot be asked.
bool is_installed(const std::string& font) {
  const TemporaryFile fonts;
  try {
    ChildProcess list({"fc-list", ":family=" + font, "family"}, {.out = fonts.descriptor()});
    return !list.succeeds() || !fonts.content().empty();
  } catch (const std::system_error&) {
    return true;
  }
}

void draw_figure(const FigureOptions& options) {
  const report::ReportFigure& figure = report::figure_named(options.name);
  const fs::path output = options.output.value_or(figure.name + ".svg");
  const report::PictureFormat format = format_of(output);
  report::FigureStyle style = options.style;
  if (options.width) style.width = print_width_in(*options.width);
  style.title = !options.no_title;
  // Leave out the caption in print: documents have their own, and the .txt file has it.
  style.caption = !options.no_caption && (!options.width || options.caption);
  // Reject marks that would end the quoted font in gnuplot's script.
  if (style.font.find_first_of("'\"\\\n,") != std::string::npos || style.font.empty())
    throw Error("--font '{}': give a font's name", style.font);
  if (style.font != report::FigureStyle().font && !is_installed(style.font))
    throw Error("--font '{}': is not installed: 'fc-list : family' lists the fonts", style.font);
  const auto x_range = range_in(options.x_range, "--x-range");
  const auto y_range = range_in(options.y_range, "--y-range");
  require_folder_of(output);
  report::FigureSource source;
  if (figure.from_sweep) source.records = read_records(options.results);
  source.scenes = options.scenes;
  source.problems = options.problems;
  const report::Sheet sheet =
      report::with_ranges(with_choice(figure.make(source), options.panels, options.series), x_range, y_range);
  if (options.numbers) return print(report::numbers_of(sheet), "the figure " + figure.name);
  const report::RenderedFigure rendered = report::rendered(sheet, format, style);
  for (const auto& [extension, content] :
       {std::pair(output.extension(), &rendered.picture), std::pair(fs::path(".csv"), &rendered.points),
        std::pair(fs::path(".txt"), &rendered.caption)}) {
    const fs::path file = fs::path(output).replace_extension(extension);
    write_file(file, *content);
    fmt::print("wrote {}\n", file.string());
  }
}

/// Adds the options of the layout.
void add_style_options(CLI::App& command, FigureOptions& options) {
  command.add_option(
      "--width", options.width,
      "one-column (85 mm), two-columns (178 mm) or mm: a layout for print (default: as on the page)");
  command.add_option("--text", options.style.text, "Its text's size, points")
      ->check(number_from(5, 14))
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
  command.add_flag("--no-caption", options.no_caption, "For a figure that the document captions")
      ->excludes("--caption");
  command.add_flag("--transparent", options.style.transparent, "No white ground");
  command.add_option("--dpi", options.style.dpi, "Pixels in an inch of a .png")
      ->check(number_from(50, 2400))
      ->capture_default_str();
}

/// Adds the command `report figure`.
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

struct ReportOptions {
  std::vector<fs::path> inputs{"scenes/sweep.toml"};
  fs::path output = "out/report";
  std::optional<fs::path> scenes;
  std::optional<std::string> table;
  int threads = 0;
  bool maps = false;
  CacheOption cache;
};

/// Returns the sweep of a file, or of scenes. Throws Error.
Sweep sweep_of(const ReportOptions& options) {
  if (options.inputs.front().extension() != ".toml") return substep::sweep_of(options.inputs, options.maps);
  if (options.inputs.size() > 1)
    throw Error("{}: give one sweep file, or scenes", options.inputs[1].string());
  if (options.maps) throw Error("--maps: give scenes; a sweep file has its own lists of n, h, τ and κ");
  return read_sweep(options.inputs.front());
}

/// Returns the cost of the tables that --table prints. Throws Error.
report::Cost table_cost(const std::string& name) {
  if (name == "descendants-rows") return report::Cost::rows;
  if (name == "descendants-time") return report::Cost::time;
  throw Error("--table '{}': give descendants-rows or descendants-time", name);
}

/// Draws the scene's end by the five algorithms with default settings, three pictures in a row.
std::string still_of(const Scene& scene, int threads) {
  TimeSheetSettings sheet;
  sheet.comparison.step = scene.step;
  sheet.comparison.has_reference = false;
  sheet.comparison.threads = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  sheet.comparison.panels =
      default_panels({[&](Algorithm algorithm) { return usual_settings(scene, algorithm); }, false});
  sheet.comparison.panels.pop_back();  // the reference
  sheet.times = {std::floor(scene.duration / scene.step + 1e-9) * scene.step};
  sheet.runs_in_row = 3;
  sheet.width = 384;
  sheet.height = 216;
  sheet.text = 24;
  sheet.camera = still_camera_named("scene", scene);
  return to_png(draw_time_sheet(scene, sheet).image);
}

void report(const ReportOptions& options) {
  std::optional<report::Cost> cost;
  if (options.table) cost = table_cost(*options.table);
  const Sweep sweep = sweep_of(options);
  std::error_code failure;
  fs::create_directories(options.output / "figures", failure);
  if (failure) throw Error("{}: cannot be made: {}", options.output.string(), failure.message());
  const fs::path& results = options.output;
  note_damaged_jobs(sweep, results);
  Progress progress;
  progress.show("sweep", 0);
  run_sweep(sweep, {results, options.threads, 1, 1, options.cache.cache()},
            [&](double fraction) { progress.show("sweep", fraction); });
  report::FigureSource source;
  source.records = merge_sweep(sweep, results);
  progress.clear();
  note_omitted_runs(source.records);
  if (cost)
    return print(report::equal_cost_of_descendants(source.records, *cost), "the table " + *options.table);
  source.scenes = options.scenes.value_or(options.inputs.front().parent_path());
  source.properties = sweep.properties;
  if (sweep.scenes.size() <= report::most_cards) {
    for (const auto& [name, scene] : sweep.scenes) {
      progress.show("drawing ends", 0);
      source.stills[name] = still_of(scene, options.threads);
    }
  }
  const report::Document page =
      report::make_report(source, [&](double fraction) { progress.show("drawing", fraction); });
  progress.clear();
  for (const report::Document::Block& block : page.blocks) {
    if (block.kind != report::Document::Block::Kind::picture) continue;
    fs::path file = options.output / block.file;
    write_file(file, block.content);
    for (const auto& [suffix, text] : block.other_files) write_file(file.replace_extension(suffix), text);
  }
  for (const auto& [name, text] :
       {std::pair("report.md", report::to_markdown(page)), std::pair("report.html", report::to_html(page))}) {
    write_file(options.output / name, text);
    fmt::print("wrote {}\n", (options.output / name).string());
  }
}

}  // namespace

void add_report_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "report", "Run a sweep and write a page: speed against error, and what to choose when");
  const auto options = std::make_shared<ReportOptions>();
  command->require_subcommand(0, 1);
  command
      ->add_option("inputs", options->inputs,
                   "A sweep file, .toml; or scenes, which each algorithm solves from coarse to fine")
      ->capture_default_str();
  command->add_option("--output", options->output, "Folder of the page, its figures and the sweep's results")
      ->capture_default_str();
  command->add_option("--scenes", options->scenes,
                      "Folder of the scenes for the sweep file's 'properties' (default: that file's folder)");
  command->add_option("--table", options->table,
                      "Print this table alone as Markdown: descendants-rows, descendants-time");
  command->add_flag("--maps", options->maps, "Also map each scene over n and h, and over τ and κ");
  command->add_option("--threads", options->threads, "Jobs at a time; 0: one a core")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  options->cache.add_to(*command);
  command->footer(
      "Jobs that are finished in the output folder are not run again. report.html needs no other file. "
      "'report figure' draws one figure, 'report claims' measures what Nohra's report claims.\n"
      "Example:\n  substep report --output report\n  substep report scenes/pendulum.gltf "
      "scenes/box_stack.gltf");
  add_figure_command(*command);
  add_claims_command(*command);
  add_published_command(*command);
  add_mlcp_command(*command);
  command->callback([options, command] {
    if (command->get_subcommands().empty()) report(*options);
  });
}

}  // namespace substep::render
