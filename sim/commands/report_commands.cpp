#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/commands/output.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/measure/claims.h"
#include "sim/study/published.h"

namespace substep {
namespace {

struct ClaimsOptions {
  std::filesystem::path scenes = "scenes";
  OutputOption output;
};

void claims(const ClaimsOptions& options) {
  options.output.require_folder();
  std::string text;
  {
    Progress progress;
    text = measure_claims(options.scenes, [&](double fraction) { progress.show("measuring", fraction); });
  }
  options.output.write(text);
}

struct PublishedCommandOptions {
  std::filesystem::path file = "scenes/published.toml";
  PublishedOptions measure;
  OutputOption output;
};

void published(PublishedCommandOptions options) {
  options.output.require_folder();
  if (options.output.file) {
    require_separate_files(std::vector<GivenFile>{{"the published results", options.file}},
                           std::vector<GivenFile>{{"--output", *options.output.file}});
  }
  const std::vector<PublishedResult> results = read_published(options.file);
  std::vector<PublishedMeasurement> measurements;
  {
    Progress progress;
    options.measure.progress = [&](double fraction) { progress.show("measuring", fraction); };
    measurements = measure_published(results, options.measure);
  }
  if (measurements.empty())
    throw Error("--only '{}': no result with a run has this in its name", options.measure.only);
  options.output.write(to_markdown(measurements));
}

}  // namespace

void add_claims_command(CLI::App& report) {
  CLI::App* const command =
      report.add_subcommand("claims", "Measure the report's claims about its algorithms; print the tables");
  const auto options = std::make_shared<ClaimsOptions>();
  command->add_option("--scenes", options->scenes, "Folder of the scene files")->capture_default_str();
  options->output.add_to(*command);
  command->footer(
      "A claim that does not hold is a finding: the exit code is still 0. Only times, marked by ~, differ "
      "from run to run.\n"
      "Example:\n  substep report claims");
  command->callback([options] { claims(*options); });
}

void add_published_command(CLI::App& report) {
  CLI::App* const command = report.add_subcommand(
      "published", "Run scenes whose results others published, and compare; print the tables");
  const auto options = std::make_shared<PublishedCommandOptions>();
  command->add_option("file", options->file, "Reported results and our runs, .toml")->capture_default_str();
  command->add_flag("--quick", options->measure.quick, "Only the runs that take a few seconds");
  command->add_option("--only", options->measure.only, "Only results whose names contain this");
  command->add_option("--threads", options->measure.threads, "Runs at a time")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  options->output.add_to(*command);
  command->footer(
      "A result that is not met is a finding: the exit code is still 0. Only times, marked by ~, differ from "
      "run to run.\n"
      "Example:\n  substep report published --quick");
  command->callback([options] { published(*options); });
}

}  // namespace substep
