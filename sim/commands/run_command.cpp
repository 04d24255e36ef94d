#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/commands/output.h"
#include "sim/direct/mlcp.h"
#include "sim/loading/scene_settings.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"
#include "sim/measure/invariants.h"
#include "sim/measure/metrics.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  SceneOptions scene;
  SolverOptions solver;
  std::optional<fs::path> output;
  int every = 1;
  std::optional<fs::path> csv;
  bool strict = false;
};

/// The figures and warnings of a run. With --strict warnings are errors.
class RunSummary {
 public:
  RunSummary(const Simulation& simulation, const Settings& settings)
      : scene_(simulation.scene()),
        settings_(settings),
        invariants_(scene_, simulation.state()),
        // Measure penetration about 60 times per simulated second, since that searches for contacts again.
        every_(std::max(1, static_cast<int>(std::lround(1 / (60 * settings.step))))) {
    invariants_.add(simulation.state(), 0, metrics_);
  }

  void add(int step, const StepReport& report, const State& state) {
    if (report.status == StepReport::Status::unsolved) ++unsolved_;
    if (report.status == StepReport::Status::least_squares) {
      ++least_squares_;
      contradicting_ = std::max(contradicting_, report.contradicting);
      residual_ = std::max(residual_, report.residual);
    }
    invariants_.follow(state, settings_.step, metrics_);
    if (step % every_ == 0) invariants_.add(state, step * settings_.step, metrics_);
  }

  void print(int steps, bool diverged) const {
    fmt::print(
        "deepest penetration {:.3g} m, largest joint gap {:.3g} m, largest rise of the energy above the "
        "start's {:.3g} J\n",
        metrics_.penetration, metrics_.joint_gap, metrics_.energy_growth);
    if (unsolved_ > 0) fmt::print("{} of {} steps not solved\n", unsolved_, steps);
    if (diverged) fmt::print("step {} diverged\n", steps + 1);
    if (least_squares_ > 0) {
      fmt::print(
          "{} of {} steps solved in the least-squares sense: up to {} rows contradict one another, by up "
          "to {:.1e} of the largest right-hand side, in directions below the rank tolerance of {:.0e}\n",
          least_squares_, steps, contradicting_, residual_, MlcpSolver::rank_tolerance);
    }
  }

  /// Prints the warnings of a run that did not diverge, except `doubt`, which was printed before the run.
  /// Returns the errors, first the run's `end` unless it is "ok"; empty where there is none.
  std::string judge(const std::string& end, bool is_strict, const std::string& doubt) const {
    std::vector<std::string> errors;
    if (end != "ok") errors.push_back(end);
    std::vector<Violation> warnings;
    for (const Violation& violation : violations(scene_, settings_, metrics_)) {
      if (is_strict || violation.severity == Violation::Severity::torn) {
        errors.push_back(violation.text);
      } else if (!end.starts_with("diverged") && violation.text != doubt) {
        warnings.push_back(violation);
      }
    }
    if (is_strict && least_squares_ > 0)
      errors.push_back(fmt::format("{} steps solved in the least-squares sense only", least_squares_));
    warn_of(scene_, label(settings_), warnings);
    return fmt::format("{}", fmt::join(errors, "; "));
  }

 private:
  const Scene& scene_;
  Settings settings_;
  Invariants invariants_;
  int every_;
  Metrics metrics_;
  int unsolved_ = 0;
  int least_squares_ = 0;
  int contradicting_ = 0;  // most contradicting rows of a step
  double residual_ = 0;    // largest of a least-squares step
};

/// Throws Error if an output is also another output or a file of the scene, or cannot be written.
void require_outputs(const RunOptions& options, const fs::path& output, const fs::path& problem) {
  require_folder_of(output);
  std::vector<GivenFile> outputs{{"--output", output}, {"the unsolved problem", problem}};
  if (options.csv) {
    require_folder_of(*options.csv);
    outputs.push_back({"--csv", *options.csv});
  }
  options.scene.require_separate(outputs);
}

void run(const RunOptions& options) {
  const Scene scene = options.scene.load();
  const Settings settings = options.solver.settings(scene);
  const int steps = options.solver.steps(scene, settings);
  const fs::path output =
      options.output.value_or(fmt::format("{}.{}.poses.txt", scene.name, name(settings.algorithm)));
  const fs::path problem = output.string() + ".unsolved.txt";
  require_outputs(options, output, problem);
  if (settings.algorithm == Algorithm::a1) note_cost_of_a1(scene);
  const std::string doubt = doubt_about_substeps(scene, settings);
  if (!doubt.empty() && !options.strict)
    warn_of(scene, label(settings), {{doubt, Violation::Severity::warning}});
  Simulation simulation(scene, settings);
  std::optional<OutputFile> table;
  const auto add_to_table = [&](int step) {
    if (table) table->write(csv_lines(scene, simulation.state(), step * settings.step));
  };
  if (options.csv) table.emplace(*options.csv).write(fmt::format("{}\n", csv_columns));
  add_to_table(0);
  std::string unsolved;
  RunSummary summary(simulation, settings);
  WrittenRun written;
  {
    Progress progress;
    written = record_to(output, simulation, steps, options.every, [&](int frame, const StepReport& report) {
      add_to_table(frame);
      summary.add(frame, report, simulation.state());
      if (report.status == StepReport::Status::unsolved && unsolved.empty())
        unsolved = simulation.last_problem();
      progress.show("simulating", static_cast<double>(frame) / steps);
    });
  }
  if (table) table->publish();
  fmt::print("{}: {}\n{}: {} steps, {:g} s\nwrote {}\n", scene.name, simulation.modelled(), label(settings),
             written.last_frame, written.last_frame * settings.step, output.string());
  if (table) fmt::print("wrote {}\n", options.csv->string());
  if (const int parts = simulation.equal_parts(); parts > 1) {
    fmt::print("a step was taken in up to {} parts: {}\n", parts, reason_of_parts);
  }
  summary.print(written.last_frame, written.end.starts_with("diverged"));
  std::string message = summary.judge(written.end, options.strict, doubt);
  if (message.empty()) return;
  message = fmt::format("{}: {} {}", scene.name, label(settings), message);
  if (!unsolved.empty()) {
    write_file(problem, unsolved);
    message += fmt::format("; the first problem that was not solved is in {}", problem.string());
  }
  std::fflush(stdout);
  fmt::print(stderr, "substep: {}\n", message);
  throw CLI::RuntimeError(1);
}

}  // namespace

void add_run_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("run", "Simulate a scene with one algorithm; write a pose log");
  const auto options = std::make_shared<RunOptions>();
  options->scene.add_to(*command);
  options->solver.add_algorithm_to(*command);
  options->solver.add_to(*command);
  command->add_option("--output", options->output, "The pose log (SCENE.ALGORITHM.poses.txt)");
  command->add_option("--every", options->every, "Steps between full poses; each step has a hash")
      ->capture_default_str();
  command->add_option("--csv", options->csv,
                      "Also write centres of mass, orientations and velocities as a table");
  command->add_flag("--strict", options->strict, "Treat warnings and least-squares steps as errors");
  command->footer(
      "Ends with code 1 when the run diverges, a step is not solved or a joint opens by more than the "
      "scene's size. The log's last line reports divergence and unsolved steps.\n"
      "Redundant rows that contradict one another, as in closed loops, are solved in the least-squares "
      "sense, which is reported at the end.\n"
      "Warnings compare with the start: a joint gap above a hundredth of the scene or a tenth of the "
      "smallest body; a penetration above a tenth of the smallest body; bodies that pass through others; "
      "without drives, an energy growth above a tenth of the sum of the initial kinetic energy and that of a "
      "fall by the scene's size; where nothing brakes joints either, an energy loss above that limit; for "
      "free bodies, an energy or momentum drift above a hundredth; in A4 and A5, summed rotation that turns "
      "a body's momentum by 0.1 rad. Before the run: sub-steps too few for the masses, or so many that A5 "
      "gets worse.\n"
      "Smaller steps or sub-steps may not reduce an energy growth; a smaller κ may (scenes/claims.md, claim "
      "15).\n"
      "Example:\n"
      "  substep run scenes/rod_chain.gltf --algorithm a3 --step 1/60 --substeps 4 --csv rod_chain.csv");
  command->callback([options] { run(*options); });
}

}  // namespace substep
