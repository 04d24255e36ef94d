#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "golden/commands/commands.h"
#include "golden/review/review.h"

namespace substep {
namespace {

void review_results(const ReviewOptions& options) {
  const Review found = review(options, [](const std::string& address) {
    fmt::print("review: {}\n", address);
    std::fflush(stdout);
  });
  fmt::print("{} approved, {} rejected, {} left\n", found.approved.size(), found.rejected.size(),
             found.left.size());
  if (!found.rejected.empty() || !found.left.empty()) throw CLI::RuntimeError(1);
}

}  // namespace

void add_review_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "review",
      "Serve the last check's report to this machine's browser, with buttons that approve and reject");
  const auto options = std::make_shared<ReviewOptions>();
  command->add_option("--suite", options->suite, "The suite file that was checked, or its folder")
      ->capture_default_str();
  command->add_option("--output", options->output, "The folder that the check wrote to")
      ->capture_default_str();
  command->add_option("--port", options->port, "Port on 127.0.0.1; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->footer(
      "Open the address that it prints. Ends with the page's button, or when every case is decided: with\n"
      "code 0 where all are approved, else 1. What is rejected is noted in rejected.json in the results'\n"
      "folder.\nExample:\n  substep review --port 8080");
  command->callback([options] { review_results(*options); });
}

}  // namespace substep
