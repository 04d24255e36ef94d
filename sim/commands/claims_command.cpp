#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "sim/commands/commands.h"
#include "sim/commands/progress.h"
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
};

void claims(const ClaimsOptions& options) {
  std::string (*text_of)(const ClaimsReport&) = nullptr;
  if (options.format == "table") text_of = to_table;
  if (options.format == "markdown") text_of = to_markdown;
  if (options.format == "json") text_of = to_json;
  if (!text_of) throw Error(fmt::format("--format '{}': give table, markdown or json", options.format));
  if (options.output) require_folder_of(*options.output);

  std::string text;
  {
    Progress progress;
    text = text_of(measure_claims(options.scenes, [&](int number) {
      constexpr double count = 16;
      progress.show("measuring", (number - 1) / count);
    }));
  }
  if (options.output) {
    write_file(*options.output, text);
    fmt::print("wrote {}\n", options.output->string());
  } else {
    fmt::print("{}", text);
  }
}

}  // namespace

void add_claims_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("claims", "Measure what the report claims of its algorithms; print the table");
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  command->add_option("--format", options->format, "table, markdown or json")->capture_default_str();
  command->add_option("--output", options->output, "Write to this file instead of the terminal");
  command->footer(
      "A claim that does not hold is a finding: the code is 0 all the same. Timings, marked by ~, differ "
      "from\n"
      "run to run; all else is the same.\n"
      "Example:\n  substep claims --format markdown");
  command->callback([options] { claims(*options); });
}

}  // namespace substep
