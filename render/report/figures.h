#pragma once
/// The figures of the report, each a sheet of plots.

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "render/report/plot.h"
#include "sim/measure/text_table.h"
#include "sim/study/sweep.h"

namespace substep::report {

/// The data that figures are drawn from.
struct FigureSource {
  std::vector<SweepRecord> records;             ///< of a sweep
  std::filesystem::path scenes = "scenes";      ///< folder of the scene files, for figures without a sweep
  bool properties = true;                       ///< whether a page has figures without a sweep
  std::vector<std::filesystem::path> problems;  ///< files of friction problems
  std::map<std::string, std::string> stills;    ///< PNG of the algorithms at a scene's end, by scene

  /// Loads the scene of a file in `scenes`, by its name without ".gltf". Throws Error.
  Scene scene(const std::string& name) const;
};

struct ReportFigure {
  std::string name;   ///< "work-rows"
  std::string about;  ///< one line, for a list
  bool reproducible;  ///< the same in every run; figures of CPU times are not
  bool from_sweep;    ///< needs records
  std::function<Sheet(const FigureSource&)> make;
};

/// Returns all figures, in the report's order.
const std::vector<ReportFigure>& figures();

/// Returns a figure. Throws Error, which lists the names.
const ReportFigure& figure_named(const std::string& name);

/// Returns the numbers of a sheet. A panel's table has a row for each x and a column for each series, with
/// the range where there are several values; a panel with notes has a row for each note.
std::vector<TextTable> numbers_of(const Sheet& sheet);

/// A figure as files.
struct RenderedFigure {
  std::string picture;
  std::string points;   ///< CSV, a line for each point: panel, series, the axes' titles, x, y, its value
  std::string caption;  ///< caption_text()
  std::vector<LeftOut> left_out;
};
/// Draws the sheet; returns its files.
RenderedFigure rendered(const Sheet& sheet, PictureFormat format, const FigureStyle& style = {});

/// The x axis and the choice of lines of work_sheet().
enum class WorkFigure { rows, time, engines, engine_steps };
/// Draws errors against work, a panel for each scene with contacts, or without.
Sheet work_sheet(const FigureSource& source, WorkFigure kind, bool contacts);
/// Draws one scene's errors against the cost of its runs, and marks the chosen ones.
Sheet choice_sheet(const std::vector<SweepRecord>& own);
Sheet order_sheet(const FigureSource& source);
Sheet equal_rows_sheet(const FigureSource& source);

Sheet step_map_sheet(const FigureSource& source);
Sheet factor_map_sheet(const FigureSource& source);
Sheet mass_ratio_sheet(const FigureSource& source);
Sheet stiffness_sheet(const FigureSource& source);
Sheet stability_sheet(const FigureSource& source);
Sheet avbd_stability_sheet(const FigureSource& source);

Sheet drift_sheet(const FigureSource& source);
Sheet size_sheet(const FigureSource& source);
/// Draws FigureSource::problems. Throws Error where there are none or more than twelve.
Sheet sweep_errors_sheet(const FigureSource& source);
Sheet coupled_rows_sheet(const FigureSource& source);
Sheet ablation_sheet(const FigureSource& source);

/// The cost at which A3 and A5 are compared with their descendants: Soft Step, small-step XPBD, AVBD and
/// warm starts.
enum class Cost { rows, time };
/// Draws a panel for each scene: the algorithms' and their descendants' figure of merit against cost.
Sheet descendants_sheet(const FigureSource& source, Cost cost);
Sheet warm_start_sheet(const FigureSource& source);
Sheet needed_substeps_sheet(const FigureSource& source);
Sheet soft_rows_sheet(const FigureSource& source);
/// Returns each algorithm's displacement in standing scenes and its error in moving ones, at the cost of A5
/// with 16 sub-steps: a table each, where there are such scenes.
std::vector<TextTable> equal_cost_of_descendants(const std::vector<SweepRecord>& records, Cost cost);

}  // namespace substep::report
