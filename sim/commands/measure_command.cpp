#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/commands/output.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_table.h"
#include "sim/measure/metrics_text.h"
#include "sim/measure/motion.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr std::array algorithms{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

struct MeasureOptions {
  SceneOptions scene;
  SolverOptions solver;
  CacheOption cache;
  std::string horizon = "2";
  int times = 0;
  bool equal_rows = false;
  bool brief = false;
  bool all = false;
  bool markdown = false;
  OutputOption output;
  std::optional<fs::path> reference;
  std::optional<fs::path> run;
};

/// Returns the usual settings of an algorithm, with those that the command line sets.
Settings settings_of(const MeasureOptions& options, const Scene& scene, Algorithm algorithm) {
  Settings settings = options.solver.settings(scene, algorithm);
  // Reset the warm start in A1, which would refuse it.
  for (const SettingsField& field : settings_fields) {
    if (field.can_be_left_out && is_of_report(field.first) && !field.is_read_by(algorithm))
      copy(settings, field, Settings{});
  }
  check(settings);
  // Give A2 as many row solves as A3 to A5 have: n·m iterations.
  const bool has_m = options.solver.has("iterations");
  if (algorithm == Algorithm::a2 && (options.equal_rows || has_m || options.solver.has("substeps"))) {
    if (!has_m) settings.iterations = 1;
    settings.iterations = iterations_at_equal_rows(settings.substeps, settings.iterations);
    check(settings);
    // Divide them among the equal parts of a step, into which taut joints divide it.
    const int parts = Simulation(scene, settings).equal_parts();
    if (parts > settings.iterations)
      fmt::print(stderr, "substep: note: A2 takes a step in {} parts: more row solves than A3 to A5\n",
                 parts);
    settings.iterations = std::max(1, settings.iterations / parts);
  }
  return settings;
}

/// Returns A1 with the smallest step that has at most 1 % more row solves than `rows`; nothing where no
/// smaller step has. Row solves of contacts depend on the active sets, so they must be measured. Shorter
/// steps are divided into fewer parts, so that they cost no more until none is divided.
std::optional<MeasuredSettings> spend_rows(const Scene& scene, const ReferenceMotion& reference,
                                           std::int64_t rows, const MeasuredSettings& direct) {
  const auto most = static_cast<double>(rows) * 1.01;
  const auto own = static_cast<double>(std::max<std::int64_t>(direct.metrics.row_solves, 1));
  const int parts = Simulation(scene, direct.settings).equal_parts();
  for (auto divisions = static_cast<int>(most / own * parts); divisions > 1; --divisions) {
    MeasuredSettings finer{direct.settings, "", {}, {}};
    finer.settings.step /= divisions;
    finer.metrics = measure(scene, finer.settings, reference);
    if (static_cast<double>(finer.metrics.row_solves) <= most) return finer;
  }
  return std::nullopt;
}

/// Returns the reference as CSV: a line per sample and body.
std::string reference_csv(const Scene& scene, const ReferenceMotion& reference) {
  std::string text = fmt::format("{},position_uncertainty,turn_uncertainty\n", csv_columns);
  for (std::size_t k = 0; k < reference.uncertainties.size(); ++k) {
    const Uncertainty& uncertainty = reference.uncertainties[k];
    text += csv_lines(scene, reference.motion.samples[k], static_cast<double>(k) * reference.motion.interval,
                      fmt::format(",{:.3g},{:.3g}", uncertainty.position, uncertainty.turn));
  }
  return text;
}

/// Returns the reference, computed on all cores where it is not in the cache.
ReferenceMotion reference_of(const MeasureOptions& options, const Scene& scene, double duration) {
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return reference_motion(scene, duration, threads, options.cache.cache());
}

/// Writes the reference's motion; exits with code 1 where there is none.
void write_reference(const MeasureOptions& options, const Scene& scene) {
  const fs::path& file = *options.reference;
  require_folder_of(file);
  options.scene.require_separate({{"--reference", file}});
  ReferenceMotion reference;
  {
    Progress progress;
    progress.show("reference", 0);
    reference = reference_of(options, scene, scene.duration);
  }
  if (reference.horizon == 0) {
    fmt::print(stderr,
               "substep: {}: no reference: {} and half its steps differ at once, at {}; nothing is written\n",
               scene.name, reference.method, reference.divergence_point);
    throw CLI::RuntimeError(1);
  }
  write_file(file, reference_csv(scene, reference));
  fmt::print("{}: {}\nwrote {}\n", scene.name, reference_text(reference), file.string());
  if (reference.horizon < scene.duration - scene.step / 2) {
    fmt::print("nothing is known, and written, of the {:g} s after that\n",
               scene.duration - reference.horizon);
  }
}

/// Returns the settings of the algorithms that are measured.
std::vector<MeasuredSettings> runs_of(const MeasureOptions& options, const Scene& scene) {
  std::vector<MeasuredSettings> runs;
  for (const Algorithm algorithm : algorithms) {
    runs.push_back({settings_of(options, scene, algorithm), "", {}, {}});
    if (options.equal_rows && algorithm == Algorithm::a2) {
      // Also measure one sweep per step of h/(n·m), with as many row solves as n·m sweeps per step of h.
      const Settings substepping = settings_of(options, scene, Algorithm::a3);
      Settings single_sweeps = runs.back().settings;
      single_sweeps.step /= substepping.substeps * substepping.iterations;
      single_sweeps.iterations = 1;
      runs.push_back({single_sweeps, "", {}, {}});
    }
  }
  for (const MeasuredSettings& run : runs) Sampling(run.settings.step, scene.step);
  return runs;
}

/// Measures the runs or, with --run, the states of a pose table in their place.
void measure_runs(const MeasureOptions& options, const Scene& scene, std::vector<State> states,
                  SceneMeasurement& measurement) {
  Progress progress;
  progress.show("reference", 0);
  const double horizon = std::min(seconds_in(options.horizon, "--horizon"), scene.duration);
  const ReferenceMotion& reference = measurement.reference = reference_of(options, scene, horizon);
  measurement.stands = stands(scene, reference);
  measurement.driven = is_driven(scene);
  std::vector<MeasuredSettings>& runs = measurement.runs;
  double done = 0;
  for (MeasuredSettings& run : runs) {
    progress.show("measuring", done++ / static_cast<double>(runs.size()));
    run.metrics = options.run ? measure(scene, *recorded_stepper(std::move(states)), scene.step, reference)
                              : measure(scene, run.settings, reference);
  }
  if (options.equal_rows) {
    const std::int64_t rows = runs.back().metrics.row_solves;
    if (auto finer = spend_rows(scene, reference, rows, runs.front()))
      runs.insert(runs.begin() + 1, std::move(*finer));
  }
  if (options.times == 0) return;
  for (MeasuredSettings& run : runs) run.times = time_run(scene, run.settings, options.times);
}

/// Throws Error for options that cannot be used, or not with each other.
void check_options(const MeasureOptions& options, const Scene& scene) {
  check_durations(scene, options.reference ? scene.duration : seconds_in(options.horizon, "--horizon"));
  if (options.reference) return;
  if (options.brief && options.all) throw Error("--brief and --all: give one of them");
  options.output.require_folder();
  if (!options.output.file) return;
  const std::vector<GivenFile> outputs{{"--output", *options.output.file}};
  options.scene.require_separate(outputs);
  if (options.run) require_separate_files(std::vector<GivenFile>{{"the run", *options.run}}, outputs);
}

void measure_scene(const MeasureOptions& options) {
  Scene scene = options.scene.load();
  if (!options.run) note_cost_of_a1(scene);
  scene.duration = options.solver.seconds(scene);
  check_options(options, scene);
  if (options.reference) return write_reference(options, scene);
  SceneMeasurement measurement;
  std::vector<State> states;
  if (options.run) {
    states = read_pose_table(*options.run, scene, scene.step);
    scene.duration = std::min(scene.duration, static_cast<double>(states.size() - 1) * scene.step);
    measurement.runs.push_back({{.step = scene.step}, options.run->stem().string(), {}, {}});
  } else {
    measurement.runs = runs_of(options, scene);
  }
  measurement.scene = scene.name;
  measurement.size = size_of(scene);
  measurement.duration = scene.duration;
  measurement.modelled = Simulation(scene, measurement.runs.front().settings).modelled();
  measure_runs(options, scene, std::move(states), measurement);
  options.output.write(options.brief ? to_text(brief_table(measurement), options.markdown)
                                     : to_text(measurement, options.all, options.markdown));
  for (const MeasuredSettings& run : measurement.runs) {
    if (run.metrics.diverged) continue;
    warn_of(scene, label(run),
            options.run ? violations(scene, run.metrics) : violations(scene, run.settings, run.metrics));
  }
}

}  // namespace

void add_measure_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("measure",
                                               "Measure a scene with all five algorithms: errors, where they "
                                               "come from, invariants, known figures, cost");
  const auto options = std::make_shared<MeasureOptions>();
  options->scene.add_to(*command);
  options->solver.add_to(*command);
  options->cache.add_to(*command);
  command->add_option("--horizon", options->horizon, "Seconds to compare with the reference, at most")
      ->capture_default_str();
  command->add_flag(
      "--equal-rows", options->equal_rows,
      "Also A1 with steps so small, and A2 with single sweeps of steps so small, that they solve as "
      "many rows as the others");
  command->add_flag("--brief", options->brief, "Print the first table alone");
  command->add_flag("--all", options->all,
                    "Print every metric: parts of the error, residuals, momentum, values");
  command->add_option("--times", options->times, "Also CPU times: medians of so many repetitions")
      ->check(CLI::Range(0, 1000));
  command->add_flag("--markdown", options->markdown, "Tables as Markdown");
  options->output.add_to(*command);
  const auto exclude = [&](CLI::Option* option, const std::vector<const char*>& without_effect) {
    for (const char* other : without_effect) option->excludes(command->get_option(other));
  };
  exclude(command->add_option("--run", options->run, "Measure the run of a pose table (.csv) instead"),
          {"--step", "--substeps", "--set", "--times", "--equal-rows"});
  exclude(command->add_option("--reference", options->reference,
                              "Measure nothing, but write the reference's motion to this .csv file"),
          {"--step", "--substeps", "--set", "--horizon", "--times", "--equal-rows", "--brief", "--all",
           "--markdown", "--output", "--run"});
  command->footer(
      "The reference has no time-step error. Without contacts it is an integrator of order 12 in which "
      "joints hold to rounding; with contacts it is A1 at repeatedly halved steps, extrapolated to step "
      "zero. Its table has a line for each step of the scene and each body: the columns of 'run --csv', and "
      "the uncertainty of all bodies until then (m, rad). It ends where refinements differ by 2e-5 of the "
      "scene's size; where they do so at once nothing is written, and the code is 1.\n"
      "A2 gets n·m iterations over all parts of a step, as many row solves as A3 to A5, where n or m is "
      "given.\n"
      "Without --times the output is the same to the last byte, in every run and on every machine.\n"
      "Example:\n  substep measure scenes/rod_chain.gltf --substeps 4\n"
      "  substep measure scenes/rod_chain.gltf --reference rod_chain.csv --duration 2");
  command->callback([options] { measure_scene(*options); });
}

}  // namespace substep
