#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "sim/commands/commands.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/study/published.h"

namespace substep {
namespace {

struct PublishedCommandOptions {
  std::filesystem::path file = "scenes/published.toml";
  PublishedOptions measure;
  std::optional<std::filesystem::path> output;
};

void published(PublishedCommandOptions options) {
  if (options.output) {
    require_folder_of(*options.output);
    const GivenFile results{"the published results", options.file};
    const GivenFile output{"--output", *options.output};
    require_separate_files(std::span(&results, 1), std::span(&output, 1));
  }
  const std::vector<PublishedResult> results = read_published(options.file);
  std::string text;
  {
    Progress progress;
    options.measure.progress = [&](double share) { progress.show("measuring", share); };
    const std::vector<PublishedMeasurement> measurements = measure_published(results, options.measure);
    if (measurements.empty())
      throw Error(fmt::format("--only '{}': no result has this in its name", options.measure.only));
    text = to_markdown(measurements);
  }
  if (options.output) {
    write_file(*options.output, text);
    fmt::print("wrote {}\n", options.output->string());
  } else {
    fmt::print("{}", text);
  }
}

}  // namespace

void add_published_command(CLI::App& report) {
  CLI::App* const command = report.add_subcommand(
      "published", "Measure scenes that others published with a result; print the tables");
  const auto options = std::make_shared<PublishedCommandOptions>();
  command->add_option("file", options->file, "What was reported and what is run, .toml")
      ->capture_default_str();
  command->add_flag("--quick", options->measure.quick, "Only the runs that take a few seconds");
  command->add_option("--only", options->measure.only, "Only results with this in their name");
  command->add_option("--threads", options->measure.threads, "Runs at a time")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command->add_option("--output", options->output, "Write to this file instead of the terminal");
  command->footer(
      "A result that is not met is a finding: the code is 0 all the same. Times, marked by ~, differ from "
      "run to run; "
      "all else is the same.\n"
      "Example:\n  substep report published --quick");
  command->callback([options] { published(*options); });
}

}  // namespace substep
