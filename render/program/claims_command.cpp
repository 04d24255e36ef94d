#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "render/program/commands.h"
#include "render/program/progress.h"
#include "render/report/figures.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/measure/claims.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct ClaimsOptions {
  fs::path scenes = "scenes";
  std::string format = "table";
  std::optional<fs::path> output;
  std::optional<fs::path> map;
};

void claims(const ClaimsOptions& options) {
  std::string (*text_of)(const ClaimsReport&) = nullptr;
  if (options.format == "table") text_of = to_table;
  if (options.format == "markdown") text_of = to_markdown;
  if (options.format == "json") text_of = to_json;
  if (!text_of) throw Error(fmt::format("--format '{}': give table, markdown or json", options.format));
  if (options.output) require_folder_of(*options.output);
  if (options.map) require_folder_of(*options.map);

  // The map first: without gnuplot it fails at once, and nothing has been written.
  std::string map;
  if (options.map) map = draw(figure_named("stability").make({}), PictureFormat::svg);
  std::string text;
  {
    Progress progress;
    text = text_of(measure_claims(options.scenes, [&](int number) {
      constexpr double count = 14;
      progress.show("measuring", (number - 1) / count);
    }));
  }
  if (options.map) write_file(*options.map, map);
  if (options.output) {
    write_file(*options.output, text);
    fmt::print("wrote {}\n", options.output->string());
  } else {
    fmt::print("{}", text);
  }
  // Beside a table on stdout that another program reads.
  if (options.map) fmt::print(stderr, "wrote {}\n", options.map->string());
}

}  // namespace

void add_claims_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("claims", "Measure what the report claims of its algorithms; print the table");
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  command->add_option("--format", options->format, "table, markdown or json")->capture_default_str();
  command->add_option("--output", options->output, "Write to this file instead of the terminal");
  command->add_option("--map", options->map,
                      "Also draw the stability map of τ and κ, as SVG (needs gnuplot)");
  command->footer(
      "A claim that does not hold is a finding: the code is 0 all the same. Timings, marked by ~, differ "
      "from\n"
      "run to run; all else is the same.\n"
      "Example:\n  substep claims --format markdown --map stability.svg");
  command->callback([options] { claims(*options); });
}

}  // namespace substep
