#pragma once
/// The tables of the report.

#include <array>
#include <string>
#include <vector>

#include "render/report/plot.h"
#include "sim/measure/text_table.h"
#include "sim/study/sweep.h"

namespace substep::report {

/// The cheapest run of each scene for 1 % and for 0.1 % of its size.
TextTable choices_table(const std::vector<SweepRecord>& records);

/// The errors that choices are made for, over the scene's size.
inline constexpr std::array choice_tolerances{0.01, 0.001};
/// The same of one scene, a row a tolerance.
TextTable choice_table(const std::vector<SweepRecord>& own);

/// Returns a run's CPU time for a simulated second, with its spread; empty where it was not timed.
std::string milliseconds(const SweepRecord& record);

/// Returns whether a run was timed.
bool has_times(const std::vector<SweepRecord>& records);

/// The cost that choices minimise, with its unit.
std::string cost_title(const std::vector<SweepRecord>& records);

TextTable references_table(const std::vector<SweepRecord>& records);

/// Of the scenes with contacts, or of the others: they are looked for with other settings.
TextTable limits_table(const std::vector<SweepRecord>& records, bool contacts);

/// By how many powers of two the error falls from each run of a family to the next.
TextTable slopes_table(const std::vector<SweepRecord>& records);

/// A row a scene without contacts, a column a family of runs.
TextTable orders_table(const std::vector<SweepRecord>& records);
/// "A1 0.98 to 1.22, …": the range of a family's orders over the scenes.
std::string order_ranges(const TextTable& table);

struct EqualRows {
  TextTable table{{"scene", "n", "A3: n sub-steps", "A2: n iterations", "ratio"}, {}};
  std::vector<std::string> holding;  ///< scenes on which sub-steps won for every n above 1
  std::vector<std::string> failing;
};
EqualRows equal_rows(const std::vector<SweepRecord>& records);

/// How many times the cost of the cheapest run for 1 % each algorithm may spend in the next table.
inline constexpr double equal_cost_factor = 2;
/// The smallest error of each algorithm at equal cost (CPU time, where there are times, else rows solved),
/// and the setting that has it; ** around the smallest of all.
TextTable equal_cost_table(const std::vector<SweepRecord>& records);

/// Of scenes without contacts: change of energy to the end and largest rise, in parts of what there is to
/// lose, at equal row solves.
TextTable energy_table(const std::vector<SweepRecord>& records);

/// What is known of scenes whose contacts slide or roll, and what is measured of it at equal row solves.
TextTable sliding_table(const std::vector<SweepRecord>& records);

/// The energy that an undamped spring has left after a second, measured beside the closed form of implicit
/// steps.
TextTable springs_table();

TextTable runs_table(const std::vector<SweepRecord>& runs);

/// Engines that ran beside ours, with how they were set.
TextTable engines_table(const std::vector<SweepRecord>& records);

/// Of scenes that other engines ran: the cheapest run in CPU time whose bodies' RMS distance from the
/// reference is at most 10 cm, 3 cm, …, 1 mm, of A1 to A5 and of the other engines, and who is ahead.
TextTable ahead_table(const std::vector<SweepRecord>& records);

/// Runs of other engines that there are not, and why.
TextTable omitted_table(const std::vector<SweepRecord>& records, const std::vector<LeftOut>& left_out);

}  // namespace substep::report
