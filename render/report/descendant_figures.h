#pragma once
/// Figures and tables of A3 and A5 beside their descendants: Soft Step, small-step XPBD, AVBD and warm
/// starts.

#include "render/report/figures.h"
#include "sim/measure/text_table.h"

namespace substep::report {

/// Returns "A5", "Soft Step", … for settings that the comparison shows; empty for others.
std::string contender_of(const Settings& settings);

/// A run's figure of merit: the largest displacement of scenes that stand; the RMS error where the reference
/// lasts; the largest miss of known heights; else the largest joint gap or the deepest overlap.
struct Merit {
  std::string quantity;  ///< "displacement"
  double value = 0;      ///< m; infinite where the run diverged
};
Merit merit_of(const SweepRecord& record);

enum class Cost { rows, time };

/// Draws one panel a scene: the contenders' merit against cost.
Sheet descendants_sheet(const FigureSource& source, Cost cost);
/// Draws one panel a scene: A5 by n, with warm starts.
Sheet warm_start_sheet(const FigureSource& source);
/// Draws the fewest sub-steps, or iterations, that hold a stack and a chain, by mass ratio.
Sheet needed_substeps_sheet(const FigureSource& source);
/// Draws the behaviour of three stacked boxes in AVBD over their mass and β.
Sheet avbd_stability_sheet(const FigureSource& source);
/// τ and κ of A5, of XPBD and of Soft Step's rows.
Sheet soft_rows_sheet(const FigureSource& source);

/// Returns the tables of the contenders' merit at the cost of A5 with 16 sub-steps: for scenes that stand,
/// and for those that move.
std::vector<TextTable> equal_cost_of_descendants(const std::vector<SweepRecord>& records, Cost cost);

}  // namespace substep::report
