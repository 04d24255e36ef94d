#include "render/commands/run_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string_view>
#include <utility>

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
  std::ifstream stream(file, std::ios::binary);
  stream.read(found.data(), static_cast<std::streamsize>(found.size()));
  return stream.gcount() == static_cast<std::streamsize>(start.size()) && found == start;
}

/// Returns the scene that a run was made from. A log names its file.
Scene scene_of(const RunInput& input) {
  if (is_pose_table(input.file)) {
    if (!input.scene)
      throw Error(fmt::format("{}: name the table's scene with --scene FILE", input.file.string()));
    return input.mesh.load(*input.scene);
  }
  const PoseLog log = read_pose_log(input.file);
  const fs::path file = input.scene.value_or(input.file.parent_path() / log.scene);
  std::error_code ignored;
  if (!input.scene && !fs::exists(file, ignored)) {
    throw Error(fmt::format("{}: its scene {} is not beside it: name it with --scene FILE",
                            input.file.string(), log.scene));
  }
  return input.mesh.load(file);
}

PoseLog simulated(const Scene& scene, const SolverOptions& solver, const Until& until, Progress& progress) {
  const Settings settings = solver.settings(scene);
  const int most = solver.steps(scene, settings);
  int steps = until.frame || until.time ? 0 : most;
  if (until.frame) {
    if (*until.frame > most) {
      throw Error(fmt::format("--frame {}: the last is {} (--duration makes more)", *until.frame, most));
    }
    steps = *until.frame;
  }
  if (until.time) {
    const double step = std::round(*until.time / settings.step);
    if (!(step <= most)) {
      throw Error(fmt::format("--time {:g}: the run ends at {:g} s (--duration makes it longer)", *until.time,
                              most * settings.step));
    }
    steps = std::max(steps, static_cast<int>(step));
  }
  Simulation simulation(scene, settings);
  return record(simulation, steps, 1, [&](int frame, const StepReport&) {
    progress.show("simulating", static_cast<double>(frame) / steps);
  });
}

}  // namespace

void RunInput::add_to(CLI::App& command) {
  command.add_option("input", file, "A pose log or table, or a scene or mesh, which is simulated first")
      ->required();
  add_options_to(command);
}

void RunInput::add_options_to(CLI::App& command) {
  command.add_option("--scene", scene, "The scene of a pose table, or of a log that is in another folder");
  solver.add_algorithm_to(command);
  solver.add_to(command);
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

LoadedRun RunInput::load(const Until& until, Progress& progress) const {
  LoadedRun run;
  if (is_pose_table(file) || is_pose_log(file)) {
    run.scene = scene_of(*this);
    run.log = read_run(file, run.scene, run.scene.step);
    run.stem = file.filename().string();
    run.stem = run.stem.substr(0, run.stem.rfind(is_pose_table(file) ? ".csv" : ".poses.txt"));
    return run;
  }
  if (scene) throw Error("--scene: is of use with a pose log or table only");
  run.scene = mesh.load(file);
  run.log = simulated(run.scene, solver, until, progress);
  run.stem = fmt::format("{}.{}", run.scene.name, name(run.log.settings.algorithm));
  return run;
}

}  // namespace substep::render
