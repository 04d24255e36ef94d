#pragma once
/// The tables of the report.

#include <string>
#include <vector>

#include "sim/measure/contact_ablation.h"
#include "sim/measure/text_table.h"
#include "sim/study/sweep.h"

namespace substep {

/// The cheapest run of each scene for 1 % and for 0.1 % of its size.
TextTable choices_table(const std::vector<SweepRecord>& records);

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

TextTable runs_table(const std::vector<SweepRecord>& runs);

/// Engines that ran beside ours, with how they were set.
TextTable engines_table(const std::vector<SweepRecord>& records);

/// Runs of other engines that there are not, and why.
TextTable omitted_table(const std::vector<SweepRecord>& records);

TextTable contact_ablation_table(const std::vector<ContactAblationCosts>& ablation);

}  // namespace substep
