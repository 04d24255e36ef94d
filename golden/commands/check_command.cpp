#include <fmt/format.h>

#include <memory>
#include <string>

#include "golden/check/check.h"
#include "golden/check/merge.h"
#include "golden/commands/commands.h"
#include "golden/report/junit.h"
#include "golden/report/report.h"
#include "sim/commands/progress.h"

namespace substep {
namespace {

void say_where(const std::filesystem::path& output) {
  fmt::print("report: {}\nfigures: {} {}\n", report_file(output).string(), (output / "results.json").string(),
             junit_file(output).string());
}

void check_goldens(const CheckOptions& options) {
  CheckResult result;
  {
    Progress progress;
    result = check(options, [&](const CaseResult&, int number, int of) {
      progress.show("checking", static_cast<double>(number) / of);
    });
  }
  for (const CaseResult& entry : result.cases) {
    if (entry.verdict != Verdict::pass) fmt::print("{}\n", explain(entry, options));
  }
  for (const auto& orphan : result.orphans) {
    fmt::print("FAILED orphan: {} belongs to no case of {}: delete it, or put its case back\n",
               orphan.string(), options.suite.string());
  }
  fmt::print("{}\n", totals(result));
  say_where(options.output);
  if (const int code = result.exit_code()) throw CLI::RuntimeError(code);
}

void merge_shards(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& output) {
  const int code = merge(shards, output);
  say_where(output);
  if (code != 0) throw CLI::RuntimeError(code);
}

}  // namespace

void add_check_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("check", "Compare simulation and renderer with the goldens, and say which changed");
  const auto options = std::make_shared<CheckOptions>();
  const auto half = std::make_shared<std::string>();
  const auto shard = std::make_shared<std::string>();
  const auto merged = std::make_shared<std::vector<std::filesystem::path>>();
  command->add_option("--suite", options->suite, "The suite file beside its goldens, or their folder")
      ->capture_default_str();
  command->add_option("--case", options->cases,
                      "Only these: box_stack.a4, or box_stack for all of that scene");
  command->add_option("--only", *half, "poses: no pictures; images: no simulation")
      ->check(CLI::IsMember({"poses", "images"}));
  command->add_option("--output", options->output, "Folder for what a person wants to see of a failing case")
      ->capture_default_str();
  command->add_option("--shard", *shard, "Only part K of N, as K/N: for several machines");
  command->add_option("--merge", *merged,
                      "Check nothing, but put these folders of shards together in --output");
  command->footer(
      "Ends with code 0 where all pass, 1 where something differs, is new, missing or an orphan, 2 for input "
      "that\n"
      "cannot be used, 3 where only pictures differ and this is not the renderer that the goldens are exact "
      "on.\n"
      "Example:\n  substep check --case box_stack.a4");
  command->callback([options, half, shard, merged] {
    if (!merged->empty()) return merge_shards(*merged, options->output);
    if (!shard->empty()) options->shard = shard_in(*shard);
    options->poses = *half != "images";
    options->images = *half != "poses";
    check_goldens(*options);
  });
}

}  // namespace substep
