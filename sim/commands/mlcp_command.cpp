#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/commands/commands.h"
#include "sim/direct/frozen_problem.h"
#include "sim/error.h"
#include "sim/loading/file_bytes.h"
#include "sim/log/file_output.h"
#include "sim/measure/text_table.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr double tolerance = 1e-8;  // of the natural map
constexpr int most_sweeps = 4096;
constexpr std::uintmax_t largest_problem = std::uintmax_t{1} << 28;  // bytes: 1000 contacts, dense, are 1.7e8

struct MlcpOptions {
  fs::path file;
  std::optional<fs::path> siconos;
  bool markdown = false;
};

const char* verdict(const MlcpReport& report, const ConeError& error) {
  if (error.natural_map <= tolerance) return "solved";
  return report.status == MlcpReport::Status::least_squares
             ? "contradicts itself, solved in the least-squares sense"
             : "not solved";
}

/// The natural map's error after 1, 2, 4, … sweeps, until the tolerance is met.
TextTable convergence(const FrozenProblem& problem) {
  TextTable table{{"sweeps", "natural-map error"}, {}};
  std::vector<double> lambda;
  int done = 0;
  for (int sweeps = 1; sweeps <= most_sweeps; sweeps *= 2) {
    sweep_rows(problem, lambda, sweeps - done);
    done = sweeps;
    const double error = cone_error(problem, lambda).natural_map;
    table.rows.push_back({fmt::format("{}", sweeps), fmt::format("{:.2e}", error)});
    if (!(error > tolerance) || !std::isfinite(error)) break;
  }
  return table;
}

void mlcp(const MlcpOptions& options) {
  const std::string text = read_bytes(options.file, options.file.string(), largest_problem);
  const FrozenProblem problem = parse_frozen_problem(text, options.file.string());
  if (options.siconos) {
    require_folder_of(*options.siconos);
    write_file(*options.siconos, to_siconos_text(problem));
    fmt::print("wrote {}\n", options.siconos->string());
    return;
  }
  std::vector<double> lambda;
  const auto begin = std::chrono::steady_clock::now();
  const MlcpReport report = solve(problem, lambda);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
  const ConeError error = cone_error(problem, lambda);
  fmt::print("{}: {} contacts, {} rows, asymmetry {:.2g}\n", options.file.filename().string(),
             problem.contacts(), problem.mlcp.rows.size(), problem.asymmetry());
  const TextTable table{{"status", "natural-map error", "complementarity", "factorisations", "time, ms"},
                        {{verdict(report, error), fmt::format("{:.2e}", error.natural_map),
                          fmt::format("{:.2e}", error.complementarity), fmt::format("{}", report.active_sets),
                          fmt::format("~{:.3g}", time.count())}}};
  const auto print = [&](const TextTable& t) {
    fmt::print("\n{}", options.markdown ? to_markdown(t) : to_text(t));
  };
  print(table);
  print(convergence(problem));
  if (!(error.natural_map <= tolerance)) throw CLI::RuntimeError(1);
}

}  // namespace

void add_mlcp_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "mlcp", "Solve a friction problem of a file; print its error, and how sweeps converge");
  const auto options = std::make_shared<MlcpOptions>();
  command->add_option("file", options->file, "Siconos' plain text, or a problem that 'run' wrote")
      ->required();
  command->add_option("--siconos", options->siconos,
                      "Solve nothing, but write the problem in Siconos' plain text");
  command->add_flag("--markdown", options->markdown, "Tables as Markdown");
  command->footer(
      "A1's solver solves it. The natural map's error is that of Siconos, relative to the largest of |q|, "
      "|r| and "
      "|u|, and is computed by another formula than the solver's; with at most 1e-8 the problem is solved, "
      "else "
      "the code is 1. The second table is that of row-by-row sweeps, as A2's.\n"
      "Example:\n  substep mlcp box_stack.a1.poses.txt.unsolved.txt");
  command->callback([options] { mlcp(*options); });
}

}  // namespace substep
