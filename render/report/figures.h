#pragma once
/// The figures of the report, each a sheet of plots.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "render/report/plot.h"
#include "render/report/sweep.h"
#include "sim/measure/contact_ladder.h"

namespace substep {

/// What figures are drawn from.
struct FigureSource {
  std::vector<SweepRecord> records;           ///< of a sweep
  std::filesystem::path scenes = "scenes";    ///< folder of the scene files, for what no sweep holds
  std::vector<ContactPrices> contact_ladder;  ///< where there is none, it is measured when it is drawn
};

struct ReportFigure {
  std::string name;   ///< "work-rows"
  std::string about;  ///< one line, for a list
  bool reproducible;  ///< the same in every run; those of CPU times are not
  bool from_sweep;    ///< needs records
  std::function<Sheet(const FigureSource&)> make;
};

/// All there are, in the report's order.
const std::vector<ReportFigure>& figures();

/// Throws Error that lists the names.
const ReportFigure& figure_named(const std::string& name);

/// Records of one scene, in the sweep's order.
std::vector<SweepRecord> of_scene(const std::vector<SweepRecord>& records, const std::string& scene);
/// Names of the scenes, in the sweep's order.
std::vector<std::string> scenes_of(const std::vector<SweepRecord>& records);

/// RMS error over the scene's size; of bodies that stay in place and turn, the RMS turn in rad. Not finite
/// where the run ended early.
double error_of(const SweepRecord& record);
bool turns_in_place(const std::vector<SweepRecord>& records);
/// Whether the error is at least a hundred times what the reference itself may be off by; or rounding, below
/// `smallest_plotted_error`.
bool is_sure(const SweepRecord& record);

}  // namespace substep
