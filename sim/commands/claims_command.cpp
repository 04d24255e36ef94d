#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "sim/commands/commands.h"
#include "sim/commands/progress.h"
#include "sim/log/file_output.h"
#include "sim/measure/claims.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct ClaimsOptions {
  fs::path scenes = "scenes";
  std::optional<fs::path> output;
};

void claims(const ClaimsOptions& options) {
  if (options.output) require_folder_of(*options.output);
  ClaimsReport report;
  {
    Progress progress;
    report = measure_claims(options.scenes, [&](int number) {
      constexpr double count = 16;
      progress.show("measuring", (number - 1) / count);
    });
  }
  if (!options.output) {
    fmt::print("{}", to_markdown(report));
    return;
  }
  write_file(*options.output, to_markdown(report));
  fmt::print("wrote {}\n", options.output->string());
}

}  // namespace

void add_claims_command(CLI::App& report) {
  CLI::App* const command =
      report.add_subcommand("claims", "Measure what the report claims of its algorithms; print the tables");
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  command->add_option("--output", options->output, "Write to this file instead of the terminal");
  command->footer(
      "A claim that does not hold is a finding: the code is 0 all the same. Timings, marked by ~, differ "
      "from\n"
      "run to run; all else is the same.\n"
      "Example:\n  substep report claims");
  command->callback([options] { claims(*options); });
}

}  // namespace substep
