#pragma once
/// Figures and tables of A3 and A5 beside their descendants: Soft Step, small-step XPBD, AVBD and warm
/// starts.

#include "render/report/figures.h"
#include "sim/measure/text_table.h"

namespace substep::report {

/// Returns "A5", "Soft Step", … for settings that the comparison shows; empty for others.
std::string contender_of(const Settings& settings);

/// A run's figure of merit: of scenes that stand the largest displacement; where the reference lasts the RMS
/// error; where heights are known the largest miss; else the joints' largest gap, or the deepest overlap.
struct Merit {
  std::string quantity;  ///< "displacement"
  double value = 0;      ///< m; infinite where the run diverged
};
Merit merit_of(const SweepRecord& record);

enum class Cost { rows, time };

/// One panel a scene: the contenders' merit against cost.
Sheet descendants_sheet(const FigureSource& source, Cost cost);
/// One panel a scene: A5 by n, with warm starts.
Sheet warm_start_sheet(const FigureSource& source);
/// The fewest sub-steps, or iterations, that hold a stack and a chain, by mass ratio.
Sheet needed_substeps_sheet(const FigureSource& source);
/// Three boxes on one another in AVBD, over their mass and β.
Sheet avbd_stability_sheet(const FigureSource& source);
/// τ and κ of A5, of XPBD and of Soft Step's rows.
Sheet soft_rows_sheet(const FigureSource& source);

/// Tables of the contenders' merit at equal cost, that of A5 with 16 sub-steps: of scenes that stand, and of
/// those that move.
std::vector<TextTable> equal_cost_of_descendants(const std::vector<SweepRecord>& records, Cost cost);

}  // namespace substep::report
