#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/report/figures.h"
#include "render/report/report.h"
#include "render/video/time_sheet.h"
#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/model/usual_settings.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

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
    throw Error(fmt::format("{}: give one sweep file, or scenes", options.inputs[1].string()));
  if (options.maps) throw Error("--maps: give scenes; a sweep file has its own lists of n, h, τ and κ");
  return read_sweep(options.inputs.front());
}

/// The tables that can be printed by themselves.
using Tables = std::vector<TextTable> (*)(const std::vector<SweepRecord>& records);
constexpr std::array<std::pair<std::string_view, Tables>, 2> tables{
    {{"descendants-rows",
      [](const auto& records) { return equal_cost_of_descendants(records, report::Cost::rows); }},
     {"descendants-time",
      [](const auto& records) { return equal_cost_of_descendants(records, report::Cost::time); }}}};

Tables table_named(const std::string& name) {
  const auto found = std::ranges::find(tables, name, &std::pair<std::string_view, Tables>::first);
  if (found != tables.end()) return found->second;
  throw Error(fmt::format("--table '{}': give descendants-rows or descendants-time", name));
}

/// Draws the scene's end by the five algorithms with default settings, three pictures in a row.
std::string still_of(const Scene& scene, int threads) {
  TimeSheetSettings sheet;
  sheet.comparison.step = scene.step;
  sheet.comparison.has_reference = false;
  sheet.comparison.threads = std::max(threads, 1);
  for (const Algorithm algorithm :
       {Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    PanelChoice panel;
    panel.settings = usual_settings(scene, algorithm);
    sheet.comparison.panels.push_back(std::move(panel));
  }
  sheet.times = {std::floor(scene.duration / scene.step + 1e-9) * scene.step};
  sheet.runs_in_row = 3;
  sheet.width = 384;
  sheet.height = 216;
  sheet.text = 24;
  sheet.camera = still_camera_named("scene", scene);
  return to_png(draw_time_sheet(scene, sheet).image);
}

void report(const ReportOptions& options) {
  const Tables printed = options.table ? table_named(*options.table) : nullptr;
  const Sweep sweep = sweep_of(options);
  std::error_code failure;
  fs::create_directories(options.output / "figures", failure);
  if (failure) throw Error(fmt::format("{}: cannot be made: {}", options.output.string(), failure.message()));
  const fs::path& results = options.output;
  note_damaged_jobs(sweep, results);
  report::Document page;
  {
    Progress progress;
    progress.show("sweep", 0);
    run_sweep(sweep, {results, options.threads, 1, 1, options.cache.cache()},
              [&](double share) { progress.show("sweep", share); });
    merge_sweep(sweep, results);
    report::FigureSource source;
    source.records = read_records(results);
    if (printed) {
      std::string text;
      for (const TextTable& table : printed(source.records))
        text += (text.empty() ? "" : "\n") + to_markdown(table);
      fmt::print("{}", text);
      return;
    }
    source.scenes = options.scenes.value_or(options.inputs.front().parent_path());
    source.properties = sweep.properties;
    if (sweep.scenes.size() <= report::most_cards) {
      for (const auto& [name, scene] : sweep.scenes) {
        progress.show("drawing ends", 0);
        source.stills[name] = still_of(scene, options.threads);
      }
    }
    page = report::make_report(source, [&](double share) { progress.show("drawing", share); });
  }
  for (const report::Document::Block& block : page.blocks) {
    if (block.kind != report::Document::Block::Kind::picture) continue;
    fs::path file = options.output / block.file;
    write_file(file, block.content);
    for (const auto& [extension, text] : block.beside) write_file(file.replace_extension(extension), text);
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
                      "Folder of the scenes that 'properties' in the sweep file asks for (the sweep file's)");
  command->add_option("--table", options->table,
                      "Print this table alone as Markdown: descendants-rows, descendants-time");
  command->add_flag("--maps", options->maps, "Also map each scene over n and h, and over τ and κ");
  command->add_option("--threads", options->threads, "Jobs at a time; 0: one a core")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  options->cache.add_to(*command);
  command->footer(
      "What the folder holds of the sweep already is not run again. report.html needs no other file. 'report "
      "figure' draws one figure, 'report claims' measures what Nohra's report claims.\n"
      "Example:\n  substep report --output report\n  substep report scenes/pendulum.gltf "
      "scenes/box_stack.gltf");
  add_figure_command(*command);
  add_claims_command(*command);
  add_published_command(*command);
  command->callback([options, command] {
    if (command->get_subcommands().empty()) report(*options);
  });
}

}  // namespace substep::render
