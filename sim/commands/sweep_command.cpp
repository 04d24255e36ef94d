#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "sim/commands/commands.h"
#include "sim/commands/progress.h"
#include "sim/study/sweep.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct SweepCommand {
  fs::path file;
  SweepOptions options;
  CacheOption cache;
};

void run(const SweepCommand& command) {
  const Sweep sweep =
      command.file.extension() == ".toml" ? read_sweep(command.file) : sweep_of({command.file}, false);
  int done = 0;
  {
    Progress progress;
    progress.show("sweep", 0);
    command.options.cache = command.cache.cache();
    done = run_sweep(sweep, command.options, [&](double share) { progress.show("sweep", share); });
  }
  merge_sweep(sweep, command.options.results);
  fmt::print("{} jobs, {} of them done now\n", sweep.jobs.size(), done);
  for (const char* const name : {"errors.csv", "times.csv", "sweep.json"}) {
    fmt::print("wrote {}\n", (command.options.results / name).string());
  }
}

}  // namespace

void add_sweep_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("sweep", "Measure scenes with many settings, on all cores");
  const auto options = std::make_shared<SweepCommand>();
  options->file = "scenes/sweep.toml";
  command
      ->add_option("file", options->file,
                   "The sweep file, .toml; or a scene, which each algorithm solves from coarse to fine")
      ->capture_default_str();
  command->add_option("--output", options->options.results, "Folder of the results")->capture_default_str();
  command->add_option("--threads", options->options.threads, "Jobs at a time; 0: one a core")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  options->cache.add_to(*command);
  command->footer(
      "What is done is kept, and not done again: a sweep that was interrupted goes on where it stopped. "
      "Errors are\n"
      "the same in every run (errors.csv), times are not (times.csv).\n"
      "Example:\n  substep sweep scenes/sweep.toml --output results");
  command->callback([options] { run(*options); });
}

}  // namespace substep
