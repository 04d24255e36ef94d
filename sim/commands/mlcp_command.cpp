#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/direct/frozen_problem.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/measure/stepper.h"
#include "sim/measure/text_table.h"
#include "sim/measure/validity_maps.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr double tolerance = 1e-8;  // of the natural map

struct MlcpOptions {
  std::vector<fs::path> files;
  std::optional<fs::path> siconos;
  bool markdown = false;
};

const char* verdict(const MlcpReport& report, const ConeError& error) {
  if (error.natural_map <= tolerance) return "solved";
  return report.status == MlcpReport::Status::least_squares
             ? "contradicts itself, solved in the least-squares sense"
             : "not solved";
}

/// Solves the file's problem and returns its row of the table. Sets `is_solved` to false where it is not.
std::vector<std::string> solve_file(const fs::path& file, const FrozenProblem& problem, bool& is_solved) {
  std::vector<double> lambda;
  const double begin = cpu_time();
  const MlcpReport report = solve(problem, lambda);
  const double milliseconds = 1e3 * (cpu_time() - begin);
  const ConeError error = cone_error(problem, lambda);
  is_solved = is_solved && error.natural_map <= tolerance;
  return {fmt::format("{} ({} contacts, asymmetry {:.1g})", file.stem().string(), problem.contacts(),
                      problem.asymmetry()),
          verdict(report, error),
          fmt::format("{:.1e}", error.natural_map),
          fmt::format("{:.1e}", error.complementarity),
          fmt::format("{}", report.active_sets),
          fmt::format("~{:.2g}", milliseconds)};
}

void mlcp(const MlcpOptions& options) {
  if (options.siconos) {
    if (options.files.size() > 1) throw Error("--siconos: writes one problem; give one file");
    require_folder_of(*options.siconos);
    const GivenFile problem{"the problem", options.files.front()};
    const GivenFile output{"--siconos", *options.siconos};
    require_separate_files(std::span(&problem, 1), std::span(&output, 1));
    const std::string text = to_siconos_text(load_frozen_problem(options.files.front()));
    write_file(*options.siconos, text);
    fmt::print("wrote {}\n", options.siconos->string());
    return;
  }
  bool is_solved = true;
  TextTable table{{"problem", "status", "natural-map error", "complementarity", "factorisations", "CPU, ms"},
                  {}};
  for (const fs::path& file : options.files)
    table.rows.push_back(solve_file(file, load_frozen_problem(file), is_solved));
  fmt::print("{}", to_text(table, options.markdown));
  if (options.files.size() == 1) {
    TextTable convergence{{"sweeps", "natural-map error"}, {}};
    for (const auto& [sweeps, error] : sweep_errors(load_frozen_problem(options.files.front()), tolerance))
      convergence.rows.push_back({fmt::format("{}", sweeps), fmt::format("{:.2e}", error)});
    fmt::print("\n{}", to_text(convergence, options.markdown));
  }
  if (!is_solved) throw CLI::RuntimeError(1);
}

}  // namespace

void add_mlcp_command(CLI::App& report) {
  CLI::App* const command = report.add_subcommand(
      "mlcp", "Solve friction problems of files; print their errors, and how sweeps converge");
  const auto options = std::make_shared<MlcpOptions>();
  command->add_option("files", options->files, "Siconos' plain text, or problems that 'run' wrote")
      ->required();
  command->add_option("--siconos", options->siconos,
                      "Solve nothing, but write the problem in Siconos' plain text");
  command->add_flag("--markdown", options->markdown, "Tables as Markdown");
  command->footer(
      "Solves with A1's solver. The natural-map error is that of Siconos, relative to the largest of |q|, "
      "|r| and |u|, by another formula than the solver's. Up to 1e-8 the problem counts as solved; "
      "otherwise the code is 1. For one file a second table lists the error of row-by-row sweeps, as in "
      "A2.\n"
      "Example:\n  substep report mlcp box_stack.a1.poses.txt.unsolved.txt");
  command->callback([options] { mlcp(*options); });
}

}  // namespace substep
