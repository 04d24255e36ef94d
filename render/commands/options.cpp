#include "render/commands/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <utility>

#include "render/video/panel.h"
#include "render/video/titles.h"
#include "sim/error.h"
#include "sim/log/pose_table.h"
#include "sim/model/state.h"
#include "sim/simulation.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

bool is_pose_log(const fs::path& file) {
  constexpr std::string_view start = "substep pose log";
  std::string found(start.size(), ' ');
  std::ifstream(file, std::ios::binary).read(found.data(), static_cast<std::streamsize>(found.size()));
  return found == start;
}

/// Returns the scene of a pose table or log. A log names its scene's file.
Scene scene_of(const RunInput& input) {
  if (is_pose_table(input.file)) {
    if (!input.scene) throw Error("{}: name the table's scene with --scene FILE", input.file.string());
    return input.mesh.load(*input.scene);
  }
  const PoseLog log = read_pose_log(input.file);
  const fs::path file = input.scene.value_or(input.file.parent_path() / log.scene);
  std::error_code ignored;
  if (!input.scene && !fs::exists(file, ignored)) {
    throw Error("{}: its scene {} is not beside it: name it with --scene FILE", input.file.string(),
                log.scene);
  }
  return input.mesh.load(file);
}

/// Simulates the scene to the end, at most for its duration. Throws Error where the end is later.
PoseLog simulated(const Scene& scene, const SolverOptions& solver, const RunEnd& end, Progress& progress) {
  const Settings settings = solver.settings(scene);
  const int most = solver.steps(scene, settings);
  int steps = end.frame || end.time ? 0 : most;
  if (end.frame) {
    if (*end.frame > most)
      throw Error("--frame {}: the last is {} (--duration makes more)", *end.frame, most);
    steps = *end.frame;
  }
  if (end.time) {
    const double step = std::round(*end.time / settings.step);
    if (!(step <= most)) {
      throw Error("--time {:g}: the run ends at {:g} s (--duration makes it longer)", *end.time,
                  most * settings.step);
    }
    steps = std::max(steps, static_cast<int>(step));
  }
  Simulation simulation(scene, settings);
  return record(simulation, steps, 1, [&](int frame, const StepReport&) {
    progress.show("simulating", static_cast<double>(frame) / steps);
  });
}

}  // namespace

std::optional<double> finite_number_in(std::string_view text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc{} || parsed.ptr != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

CLI::Validator number_from(double low, double high) {
  const std::string range = fmt::format("{:g} to {:g}", low, high);
  const auto fault_in = [low, high, range](const std::string& text) {
    const std::optional<double> number = finite_number_in(text);
    const bool is_good = number && *number >= low && *number <= high;
    return is_good ? "" : fmt::format("'{}': give a number from {}", text, range);
  };
  return {fault_in, range};
}

double print_width_in(const std::string& text) {
  if (text == "one-column") return 85;
  if (text == "two-columns") return 178;
  const std::optional<double> width = finite_number_in(text);
  if (!width || !(*width >= 40 && *width <= 1000))
    throw Error("--width '{}': give one-column (85 mm), two-columns (178 mm) or 40 to 1000, in mm", text);
  return *width;
}

void ComparisonOptions::add_settings_to(CLI::App& command) {
  solver.add_to(command);
  add_panels_to(command);
  command.add_option("--start", start_, "Seconds into the run at which the film begins")
      ->capture_default_str();
  command.add_option("--end", end_, "Seconds into the run at which it ends (the duration)");
  command.add_option("--speed", speed, "Seconds of the scene in a second of film: 0.25 is slow motion")
      ->check(number_from(1e-3, 1e3))
      ->capture_default_str();
  command.add_option("--fps", frame_rate, "Frames in a second of film")
      ->check(number_from(1, 240))
      ->capture_default_str();
}

void ComparisonOptions::add_panels_to(CLI::App& command) {
  command
      .add_option("--panel", panels_,
                  "A panel of its own: a1 to a5, an engine, log:FILE or reference; once for each (A1 to A5 "
                  "and the reference)")
      ->allow_extra_args(false);
  command.add_option("--panels", panels_file_, "A TOML file of [[panel]] tables")->check(CLI::ExistingFile);
  command.add_flag("--no-reference", no_reference_, "Simulate none, and show no errors");
  cache_.add_to(command);
  command
      .add_option("--reference-substeps", reference_substeps_,
                  "The reference is at the step divided by this, its check at half as many; where nothing "
                  "moves a fourth of these is enough")
      ->capture_default_str();
  command.add_option("--threads", threads_, "Threads; the result is the same for any number")
      ->capture_default_str();
}

ComparisonSettings ComparisonOptions::settings(const Scene& scene_to_show) {
  const Settings base = solver.settings(scene_to_show);
  const PanelDefaults defaults{[&](Algorithm algorithm) { return solver.settings(scene_to_show, algorithm); },
                               solver.has("substeps") || solver.has("iterations")};
  ComparisonSettings settings;
  if (panels_file_) {
    PanelFile file = read_panels(*panels_file_, defaults);
    settings.panels = std::move(file.panels);
    if (title.empty()) title = file.title;
  }
  for (const std::string& text : panels_) settings.panels.push_back(panel_in(text, defaults));
  if (settings.panels.empty()) {
    settings.panels = default_panels(defaults);
    if (no_reference_) settings.panels.pop_back();
  }
  settings.step = base.step;
  settings.has_reference = !no_reference_;
  settings.reference_substeps = reference_substeps_;
  // Warn of the reference's cost too: with contacts A1 computes it.
  const bool has_a1 = std::ranges::any_of(settings.panels, [](const PanelChoice& panel) {
    return panel.kind == PanelChoice::Kind::algorithm && panel.settings.algorithm == Algorithm::a1;
  });
  if (has_a1 || settings.has_reference) note_cost_of_a1(scene_to_show);
  settings.start = seconds_in(start_, "--start");
  settings.duration = solver.seconds(scene_to_show);
  if (end_) {
    const double end = seconds_in(*end_, "--end");
    if (!(end >= settings.start && end <= settings.duration)) {
      throw Error("--end {}: must be from --start to the end of the run, {:g} s (--duration makes it longer)",
                  *end_, settings.duration);
    }
    settings.duration = end;
  }
  settings.frame_interval = speed / frame_rate;
  settings.threads = threads_;
  settings.cache = cache_.cache();
  if (!(threads_ >= 1 && threads_ <= 64)) throw Error("--threads {}: must be from 1 to 64", threads_);
  return settings;
}

void print_table(const Comparison& comparison, double end) {
  fmt::print("{}", to_text(table_of(comparison, true)));
  if (comparison.reference) fmt::print("{}\n", words_on_reference(comparison));
  const double last = comparison.times.back();
  if (last < end - 1e-6) fmt::print("the last frame is at {:g} s, before the end at {:g} s\n", last, end);
}

void warn_of(const Scene& scene, const Comparison& comparison) {
  for (const Run& run : comparison.runs) {
    warn_of(scene, fmt::format("{} {}", name_of(run.panel), settings_of(run.panel)), run.violations);
  };
}

void RunInput::add_options_to(CLI::App& command) {
  command.add_option("--scene", scene, "The scene of a pose table, or of a log that is in another folder");
  const std::vector<CLI::Option*> before = command.get_options();
  solver.add_algorithm_to(command);
  solver.add_to(command);
  options_of_solver_ = command.get_options(
      [&](CLI::Option* option) { return std::ranges::find(before, option) == before.end(); });
  mesh.add_mesh_options_to(command);
}

void RunInput::require_separate(const fs::path& output) const {
  std::vector<GivenFile> inputs{{"the input", file}};
  if (scene) inputs.push_back({"--scene", *scene});
  require_separate_files(inputs, std::vector<GivenFile>{{"--output", output}});
}

std::optional<LoadedRun> RunInput::load_still() const {
  std::optional<Scene> still = load_still_scene(file);
  if (!still) return std::nullopt;
  LoadedRun run;
  run.scene = std::move(*still);
  for (const std::string& warning : run.scene.warnings) {
    fmt::print(stderr, "substep: note: {}\n", warning);
  }
  run.stem = run.scene.name;
  run.log.settings.step = run.scene.step;
  run.log.end = "ok";
  run.log.frames.emplace_back().poses = initial_state(run.scene).q;
  return run;
}

LoadedRun RunInput::load(const RunEnd& end, Progress& progress) const {
  LoadedRun run;
  if (is_pose_table(file) || is_pose_log(file)) {
    for (const CLI::Option* const option : options_of_solver_) {
      if (option->count() == 0) continue;
      throw Error("{}: {} is a finished run, which has its own settings: leave the option out",
                  option->get_name(), file.string());
    }
    run.scene = scene_of(*this);
    run.log = read_run(file, run.scene, run.scene.step);
    run.stem = file.filename().string();
    run.stem = run.stem.substr(0, run.stem.rfind(is_pose_table(file) ? ".csv" : ".poses.txt"));
    return run;
  }
  if (scene) throw Error("--scene: only with a pose log or table");
  run.scene = mesh.load(file);
  run.log = simulated(run.scene, solver, end, progress);
  run.stem = fmt::format("{}.{}", run.scene.name, name(run.log.settings.algorithm));
  return run;
}

}  // namespace substep::render
