#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/commands/output.h"
#include "sim/error.h"
#include "sim/execution/child_process.h"
#include "sim/study/sweep.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct SweepCommand {
  fs::path file;
  SweepOptions options;
  CacheOption cache;
  std::optional<std::string> job;
  std::optional<int> slurm;
  bool merge = false;
};

/// Submits a job array to Slurm, each of whose tasks does a part.
void submit(const SweepCommand& command, int tasks) {
  const fs::path results = fs::absolute(command.options.results);
  std::error_code failure;
  fs::create_directories(results / "slurm", failure);
  if (failure) throw Error("{}: cannot be made: {}", results.string(), failure.message());
  const std::string program = fs::read_symlink("/proc/self/exe", failure).string();
  const std::vector<std::string> words{"sbatch",
                                       "--job-name=substep-sweep",
                                       fmt::format("--array=1-{}", tasks),
                                       "--cpus-per-task=1",
                                       fmt::format("--output={}", (results / "slurm" / "%a.txt").string()),
                                       "--wrap=exec \"$SUBSTEP_PROGRAM\" sweep \"$SUBSTEP_SWEEP\" --output "
                                       "\"$SUBSTEP_RESULTS\" --threads 1 --job "
                                       "\"$SLURM_ARRAY_TASK_ID/$SUBSTEP_TASKS\"" +
                                           std::string(command.cache.is_off ? " --no-cache" : "")};
  ::setenv("SUBSTEP_PROGRAM", program.c_str(), 1);
  ::setenv("SUBSTEP_SWEEP", fs::absolute(command.file).c_str(), 1);
  ::setenv("SUBSTEP_RESULTS", results.c_str(), 1);
  ::setenv("SUBSTEP_TASKS", std::to_string(tasks).c_str(), 1);
  try {
    if (!ChildProcess(words, {}).succeeds()) throw Error("--slurm: sbatch did not take the jobs");
  } catch (const std::system_error& error) {
    throw Error(
        "--slurm: the program sbatch cannot be started ({}): on Debian, apt-get install "
        "slurm-client",
        error.code().message());
  }
  fmt::print("submitted: {} tasks\nwhen they are done: substep sweep \"{}\" --output \"{}\" --merge\n", tasks,
             command.file.string(), command.options.results.string());
}

void run(SweepCommand& command) {
  if (command.job) {
    const auto [part, parts] = two_numbers_in(*command.job, '/').value_or(std::pair(0, 0));
    if (part < 1 || part > parts)
      throw Error("--job '{}': give the part and how many there are, such as 2/8", *command.job);
    command.options.part = part;
    command.options.parts = parts;
  }
  if (command.merge + command.job.has_value() + command.slurm.has_value() > 1)
    throw Error("--job, --slurm and --merge: give one of them");
  const Sweep sweep =
      command.file.extension() == ".toml" ? read_sweep(command.file) : sweep_of({command.file}, false);
  if (command.slurm) return submit(command, std::min(*command.slurm, static_cast<int>(sweep.jobs.size())));
  int done = 0;
  if (!command.merge) {
    note_damaged_jobs(sweep, command.options.results);
    Progress progress;
    progress.show("sweep", 0);
    command.options.cache = command.cache.cache();
    done = run_sweep(sweep, command.options, [&](double share) { progress.show("sweep", share); });
  }
  if (command.job) {
    fmt::print("part {}: {} jobs done now\n", *command.job, done);
    return;
  }
  const std::vector<SweepRecord> records = merge_sweep(sweep, command.options.results);
  fmt::print("{} jobs, {} of them done now\n", sweep.jobs.size(), done);
  for (const char* const name : {"errors.csv", "times.csv", "sweep.json"}) {
    fmt::print("wrote {}\n", (command.options.results / name).string());
  }
  note_omitted_runs(records);
}

}  // namespace

void add_sweep_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("sweep", "Measure scenes with many settings, on all cores or on a cluster");
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
  command->add_option("--job", options->job, "Only this part of the jobs: 2/8 is the second of eight");
  command->add_option("--slurm", options->slurm, "Submit them to Slurm instead, as an array of so many tasks")
      ->check(CLI::Range(1, 100000));
  command->add_flag("--merge", options->merge, "Run nothing: merge the results of the parts");
  command->footer(
      "Results are kept: an interrupted sweep continues where it stopped. "
      "Errors are\n"
      "the same in every run (errors.csv), times are not (times.csv).\n"
      "Example:\n  substep sweep scenes/sweep.toml --output results");
  command->callback([options] { run(*options); });
}

}  // namespace substep
