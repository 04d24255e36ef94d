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

/// What figures are drawn from.
struct FigureSource {
  std::vector<SweepRecord> records;             ///< of a sweep
  std::filesystem::path scenes = "scenes";      ///< folder of the scene files, for what no sweep holds
  bool properties = true;                       ///< whether a page has what no sweep holds
  std::vector<std::filesystem::path> problems;  ///< friction problems, in files
  std::map<std::string, std::string> stills;    ///< PNG: the algorithms at a scene's end, by the scene

  /// The scene of a file in `scenes`, by its name without ".gltf". Throws Error.
  Scene scene(const std::string& name) const;
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

/// The numbers of a sheet: a table a panel, a line a value of x, a column a series, with the range where
/// there are several; of a panel with notes a line a note.
std::vector<TextTable> numbers_of(const Sheet& sheet);

/// The points that are drawn, a line each: panel, series, the axes' titles, x, y; a value of its own.
std::string points_csv(const Sheet& sheet);

/// A figure as files: its picture, its points and its caption.
struct DrawnFigure {
  std::string picture;
  std::string points;   ///< points_csv()
  std::string caption;  ///< caption_text()
  std::vector<LeftOut> left_out;
};
DrawnFigure drawn(const Sheet& sheet, PictureFormat format, const FigureStyle& style = {});

/// Throws Error that lists the names.
const ReportFigure& figure_named(const std::string& name);

}  // namespace substep::report
