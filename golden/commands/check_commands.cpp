#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "golden/approval/approve.h"
#include "golden/check/check.h"
#include "golden/commands/commands.h"
#include "golden/report/failures.h"
#include "golden/report/report.h"
#include "sim/commands/output.h"

namespace substep::golden {
namespace {

/// Prints a line on cases that pass with a note, such as a picture within the tolerance.
void print_notes_of_passing(const Json& results) {
  std::vector<const Json*> noted;
  for (const Json& entry : results.at("cases"))
    if (entry.at("verdict") == "pass" && !entry.at("notes").empty()) noted.push_back(&entry);
  if (noted.empty()) return;
  fmt::print("{} pass{} with a note, {}{}: {}\n", noted.size(), noted.size() == 1 ? "es" : "",
             noted.size() == 1 ? "" : "the first ", noted.front()->at("name").get<std::string>(),
             noted.front()->at("notes").at(0).get<std::string>());
}

/// Prints the simplest case of each group of failures, the groups' lines, orphans, notes of passing cases,
/// totals, and the files of report and results.
void print_outcome(const Json& results, const std::filesystem::path& output) {
  const ResultsLocation location = location_of(results, output);
  const std::vector<FailureGroup> groups = failure_groups(results);
  for (const FailureGroup& group : groups) fmt::print("{}\n", explanation(*group.cases.front(), location));
  for (const FailureGroup& group : groups) {
    if (groups.size() > 1 || group.cases.size() > 1) fmt::print("{}\n", group.line());
  }
  for (const Json& orphan : results.at("orphans")) {
    fmt::print("FAILED orphan: {} belongs to no case of {}: delete it, or put its case back\n",
               orphan.get<std::string>(), location.suite.string());
  }
  print_notes_of_passing(results);
  fmt::print("{}\n", results.at("totals").get<std::string>());
  fmt::print("report: {}\nresults: {} {}\n", report_file(output).string(), results_file(output).string(),
             junit_file(output).string());
}

void check_goldens(const CheckOptions& options) {
  Json results;
  {
    Progress progress;
    std::size_t failed = 0;
    CheckWatcher watcher;
    watcher.before_case = [&](const std::string& name, std::size_t number, std::size_t of) {
      progress.show(fmt::format("checking, {} failed, {} of {}: {}", failed, number, of, name),
                    static_cast<double>(number - 1) / static_cast<double>(of));
    };
    watcher.after_case = [&](const Json& entry) {
      if (entry.at("verdict") == "pass") return;
      ++failed;
      progress.clear();
      const auto cause = entry.at("cause").get<std::string>();
      fmt::print("failed {}: {}{}{}\n", entry.at("name").get<std::string>(),
                 entry.at("verdict").get<std::string>(), cause.empty() ? "" : ": ", cause);
      std::fflush(stdout);
    };
    results = check(options, watcher);
  }
  print_outcome(results, options.output);
  if (const int code = results.at("exit_code")) throw CLI::RuntimeError(code);
}

void approve_goldens(const ApproveOptions& options) {
  const Approval approval = approve(options);
  for (const auto& file : approval.written) fmt::print("wrote {}\n", file.string());
  for (const std::string& name : approval.already_good) fmt::print("{}: nothing to do\n", name);
  fmt::print("files written: {}\n", approval.written.size());
}

}  // namespace

void add_check_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("check", "Compare simulation and renderer with the goldens, and say which changed");
  const auto options = std::make_shared<CheckOptions>();
  command->add_option("--suite", options->suite, "The suite file beside its goldens, or their folder")
      ->capture_default_str();
  command->add_option("cases,--case", options->cases,
                      "Only these: box_stack.a4, or box_stack for all of that scene");
  command
      ->add_option("--output", options->output,
                   "Folder for the report, the results and the files of failing cases")
      ->capture_default_str();
  command->footer(
      "Ends with code 0 where all pass, 1 where something differs, is new, missing, an orphan or an error, 2 "
      "for input that cannot be used, 3 where only pictures differ and this is not the renderer that the "
      "goldens are exact on.\n"
      "Example:\n  substep check --case box_stack.a4");
  command->callback([options] { check_goldens(*options); });
}

void add_approve_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "approve", "Replace goldens with the last check's results, after you looked at them");
  const auto options = std::make_shared<ApproveOptions>();
  command->add_option("cases", options->cases,
                      "Names of cases: box_stack.a4, or box_stack for all of that scene");
  command->add_flag("--failed", options->all_failed, "All cases that did not pass");
  command->add_option("--reason", options->reason, "Why the goldens change; kept beside them");
  command->add_option("--suite", options->suite, "The suite file that was checked, or its folder")
      ->capture_default_str();
  command->add_option("--output", options->output, "The folder that the check wrote to")
      ->capture_default_str();
  command->footer(
      "Copies files, runs nothing. Refuses changes since the check, blank pictures, other renderers.\n"
      "Example:\n  substep approve box_stack.a4 --reason \"stiffer contacts, see issue 12\"");
  command->callback([options] { approve_goldens(*options); });
}

}  // namespace substep::golden
