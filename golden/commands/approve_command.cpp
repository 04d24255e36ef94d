#include <fmt/format.h>

#include <memory>
#include <string>

#include "golden/approval/approve.h"
#include "golden/commands/commands.h"

namespace substep::golden {
namespace {

void approve_goldens(const ApproveOptions& options) {
  const Approval approval = approve(options);
  for (const auto& file : approval.written) fmt::print("wrote {}\n", file.string());
  for (const std::string& name : approval.already_good) fmt::print("{}: nothing to do\n", name);
  fmt::print("{} files written\n", approval.written.size());
}

}  // namespace

void add_approve_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "approve", "Make what the last check produced the new goldens, after you looked at it");
  const auto options = std::make_shared<ApproveOptions>();
  command->add_option("cases", options->cases, "Names of cases: box_stack.a4");
  command->add_flag("--failed", options->all_failed, "All cases that did not pass");
  command->add_option("--reason", options->reason, "Why the goldens change; kept beside them");
  command->add_option("--suite", options->suite, "The suite file that was checked, or its folder")
      ->capture_default_str();
  command->add_option("--output", options->output, "The folder that the check wrote to")
      ->capture_default_str();
  command->footer(
      "Copies files and runs nothing again. Refuses when they or the goldens changed since the check.\n"
      "Example:\n  substep approve box_stack.a4 --reason \"stiffer contacts, see issue 12\"");
  command->callback([options] { approve_goldens(*options); });
}

}  // namespace substep::golden
