#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>

#include "sim/commands/commands.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"
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
  std::optional<double> rate;
};

/// Commas and quotes in a body's name stay in its field.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

/// The table for people who plot: a line per sampled step and dynamic body.
class CsvTable {
 public:
  /// Without a rate every step is sampled, with one the steps nearest to its instants.
  CsvTable(const Scene& scene, double step, std::optional<double> rate)
      : scene_(scene), step_(step), rate_(rate) {
    if (rate && !(*rate > 0)) throw Error(fmt::format("--rate {}: must be above 0", *rate));
    if (rate && *rate * step > 1 + 1e-9) {
      throw Error(
          fmt::format("--rate {}: above the {:g} steps a second that are simulated", *rate, 1 / step));
    }
  }

  /// Call for each step from 0 on.
  void add(int step, const State& state) {
    if (step != next_step()) return;
    ++sample_;
    for (std::size_t i = 1; i < scene_.bodies.size(); ++i) {
      const Body& body = scene_.bodies[i];
      if (body.inverse_mass == 0) continue;
      const Vector3& x = state.q[i].linear;
      const Quaternion r = state.q[i].angular * body.body_from_node.orientation;
      const Vector3& v = state.v[i].linear;
      const Vector3& w = state.v[i].angular;
      fmt::format_to(std::back_inserter(text_), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                     step * step_, csv_field(body.name), x.x(), x.y(), x.z(), r.w(), r.x(), r.y(), r.z(),
                     v.x(), v.y(), v.z(), w.x(), w.y(), w.z());
    }
  }

  const std::string& text() const { return text_; }

 private:
  int next_step() const {
    if (!rate_) return sample_;
    return static_cast<int>(std::llround(sample_ / (*rate_ * step_)));
  }

  const Scene& scene_;
  double step_;
  std::optional<double> rate_;
  int sample_ = 0;
  std::string text_ = "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
};

/// Steps whose redundant rows contradicted one another: the run is right but for what it names.
struct LeastSquares {
  int steps = 0;
  int rows = 0;         ///< the most in a step
  double residual = 0;  ///< the largest

  void add(const StepReport& report) {
    if (report.status != StepReport::Status::least_squares) return;
    ++steps;
    rows = std::max(rows, report.contradicting);
    residual = std::max(residual, report.residual);
  }
  void print(std::size_t of_steps) const {
    if (steps == 0) return;
    fmt::print(
        "{} of {} steps solved in the least-squares sense: up to {} rows contradict one another, by up "
        "to {:.1e} of the largest right-hand side\n",
        steps, of_steps, rows, residual);
  }
};

void run(const RunOptions& options) {
  const Scene scene = options.scene.load();
  const Settings settings = options.solver.settings(scene);
  const int steps = options.solver.steps(scene, settings);
  const fs::path output =
      options.output.value_or(fmt::format("{}.{}.poses.txt", scene.name, name(settings.algorithm)));
  require_folder_of(output);
  if (options.csv) require_folder_of(*options.csv);
  if (options.rate && !options.csv) throw Error("--rate: is of use with --csv only");
  std::optional<CsvTable> table;
  if (options.csv) table.emplace(scene, settings.step, options.rate);

  Simulation simulation(scene, settings);
  if (table) table->add(0, simulation.state());
  std::string unsolved;
  LeastSquares least_squares;
  PoseLog log;
  {
    Progress progress;
    log = record(simulation, steps, options.every, [&](int frame, const StepReport& report) {
      if (table) table->add(frame, simulation.state());
      least_squares.add(report);
      if (report.status == StepReport::Status::unsolved && unsolved.empty())
        unsolved = simulation.last_problem();
      progress.show("simulating", static_cast<double>(frame) / steps);
    });
  }
  write_pose_log(log, output);
  if (table) write_file(*options.csv, table->text());
  fmt::print("{}: {}\n{}: {} steps, {:g} s\nwrote {}\n", scene.name, log.modelled, label(settings),
             log.frames.size() - 1, static_cast<double>(log.frames.size() - 1) * settings.step,
             output.string());
  if (table) fmt::print("wrote {}\n", options.csv->string());
  least_squares.print(log.frames.size() - 1);
  if (log.end == "ok") return;

  std::string message = fmt::format("{}: {} {}", scene.name, label(settings), log.end);
  if (!unsolved.empty()) {
    const fs::path problem = output.string() + ".unsolved.txt";
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
  command->add_option("--every", options->every, "Full poses every so many steps; a hash every step")
      ->capture_default_str();
  command->add_option("--csv", options->csv,
                      "Also write centres of mass, orientations and velocities as a table");
  command->add_option("--rate", options->rate, "Lines a second and body in the table (one a step)");
  command->footer(
      "Ends with code 1 when the run diverges or a step is not solved: the log says so at its end.\n"
      "Redundant rows that contradict one another (a closed loop's) are solved in the least-squares sense:\n"
      "that is no error, and said at the end.\n"
      "Example:\n  substep run scenes/rod_chain.gltf --algorithm a3 --step 1/60 --substeps 4 --csv "
      "rod_chain.csv "
      "--rate 30");
  command->callback([options] { run(*options); });
}

}  // namespace substep
