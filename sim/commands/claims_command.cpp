#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

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
  std::vector<fs::path> outputs;
};

using TextOf = std::string (*)(const ClaimsReport&);

TextOf text_of(const std::string& format) {
  if (format == "table") return to_table;
  if (format == "markdown") return to_markdown;
  if (format == "json") return to_json;
  throw Error(fmt::format("--format '{}': give table, markdown or json", format));
}

TextOf text_by_extension(const fs::path& output) {
  const std::string extension = output.extension().string();
  if (extension == ".txt") return to_table;
  if (extension == ".md") return to_markdown;
  if (extension == ".json") return to_json;
  throw Error(fmt::format("--output {}: give a name that ends in .txt, .md or .json", output.string()));
}

void claims(const ClaimsOptions& options) {
  const TextOf on_terminal = text_of(options.format);
  for (const fs::path& output : options.outputs) {
    text_by_extension(output);
    require_folder_of(output);
  }

  ClaimsReport report;
  {
    Progress progress;
    report = measure_claims(options.scenes, [&](int number) {
      constexpr double count = 16;
      progress.show("measuring", (number - 1) / count);
    });
  }
  for (const fs::path& output : options.outputs) {
    write_file(output, text_by_extension(output)(report));
    fmt::print("wrote {}\n", output.string());
  }
  if (options.outputs.empty()) fmt::print("{}", on_terminal(report));
}

}  // namespace

void add_claims_command(CLI::App& report) {
  CLI::App* const command =
      report.add_subcommand("claims", "Measure what the report claims of its algorithms; print the table");
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  CLI::Option* const format =
      command->add_option("--format", options->format, "table, markdown or json")->capture_default_str();
  command
      ->add_option("--output", options->outputs,
                   "Write to these files instead of the terminal: .txt (table), .md or .json")
      ->excludes(format);
  command->footer(
      "A claim that does not hold is a finding: the code is 0 all the same. Timings, marked by ~, differ "
      "from\n"
      "run to run; all else is the same.\n"
      "Example:\n  substep report claims --format markdown");
  command->callback([options] { claims(*options); });
}

}  // namespace substep
