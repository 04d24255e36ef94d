#pragma once
/// The tables of the report.

#include <array>
#include <string>
#include <vector>

#include "render/report/plot.h"
#include "sim/measure/text_table.h"
#include "sim/study/sweep.h"

namespace substep::report {

/// Limits of the error, as fractions of the scene's size, for which the report chooses runs.
inline constexpr std::array choice_tolerances{0.01, 0.001};
/// Returns the cheapest run of each scene for each of `choice_tolerances`.
TextTable choices_table(const std::vector<SweepRecord>& records);
/// Returns the cheapest run of one scene, a row for each tolerance.
TextTable choice_table(const std::vector<SweepRecord>& own);

/// Returns the rows that a measured run solves in a simulated second.
double row_rate(const SweepRecord& record);

/// Returns "1 run" or "2 runs".
std::string counted(std::size_t number, const char* noun);

/// Returns whether any run was timed.
bool has_times(const std::vector<SweepRecord>& records);

/// Returns the name and unit of the cost that choices minimise.
std::string cost_title(const std::vector<SweepRecord>& records);

TextTable references_table(const std::vector<SweepRecord>& records);

struct EqualRows {
  TextTable table{{"scene", "n", "A3: n sub-steps", "A2: n iterations", "ratio"}, {}};
  std::vector<std::string> won_on;      ///< scenes on which sub-steps won for every n above 1
  std::vector<std::string> not_won_on;  ///< the other scenes
};
EqualRows equal_rows(const std::vector<SweepRecord>& records);

/// Budget of equal_cost_table(), as a multiple of the cost of the cheapest run for 1 %.
inline constexpr double equal_cost_factor = 2;
/// Returns the smallest error of each algorithm at equal cost (CPU time, where there are times, else rows
/// solved), and the setting that has it; ** around the smallest of all.
TextTable equal_cost_table(const std::vector<SweepRecord>& records);

TextTable runs_table(const std::vector<SweepRecord>& runs);

/// Returns the engines that ran beside ours, with their settings.
TextTable engines_table(const std::vector<SweepRecord>& records);

/// Returns, for scenes that other engines ran, the cheapest run within an RMS distance of 10 cm, 3 cm, …,
/// 1 mm from the reference, of A1 to A5 and of the other engines, and which side is ahead in CPU time.
TextTable ahead_table(const std::vector<SweepRecord>& records);

/// Returns the missing runs of other engines and the series left out, with the reasons.
TextTable omitted_table(const std::vector<SweepRecord>& records, const std::vector<LeftOut>& left_out);

/// Returns the stability limits of scenes with contacts, or of those without: their settings differ.
TextTable limits_table(const std::vector<SweepRecord>& records, bool contacts);

/// Returns the orders, a row for each scene without contacts, a column for each family of runs.
TextTable orders_table(const std::vector<SweepRecord>& records);

/// Returns, for scenes without contacts at equal row solves, the change of energy to the end and its largest
/// rise, over the energy that the scene can lose.
TextTable energy_table(const std::vector<SweepRecord>& records);

/// Returns the energy that an undamped spring has left after a second, beside the closed form of implicit
/// steps.
TextTable springs_table();

/// The worst figure of one algorithm in one scene, over all settings that ran.
struct BadFigure {
  std::string scene;
  Algorithm algorithm = Algorithm::a1;
  std::string label;  ///< the settings
  ExpectedFigure figure;
  int bad = 0;   ///< settings with a bad figure
  int runs = 0;  ///< settings that ran

  /// Returns the error in tolerances; infinite where there is no value.
  double severity() const { return figure.error() / figure.tolerance; }
};

/// Returns the bad figures of all scenes and algorithms, the worst first.
std::vector<BadFigure> bad_figures(const std::vector<SweepRecord>& records);
TextTable bad_figures_table(const std::vector<BadFigure>& figures);

/// Counts our runs that were compared with a known figure.
int judged_runs(const std::vector<SweepRecord>& records);

}  // namespace substep::report
