#include "render/report/figures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "sim/error.h"
#include "sim/loading/load_scene.h"

namespace substep::report {
namespace {

std::vector<ReportFigure> all_figures() {
  const auto work = [](WorkFigure kind, bool contacts) {
    return [=](const FigureSource& source) { return work_sheet(source, kind, contacts); };
  };
  const auto descendants = [](Cost cost) {
    return [=](const FigureSource& source) { return descendants_sheet(source, cost); };
  };
  return {
      {"work-rows", "error against rows solved: joints and spin", true, true, work(WorkFigure::rows, false)},
      {"work-rows-contacts", "error against rows solved: contacts", true, true, work(WorkFigure::rows, true)},
      {"work-time", "error against CPU time: joints and spin", false, true, work(WorkFigure::time, false)},
      {"work-time-contacts", "error against CPU time: contacts", false, true, work(WorkFigure::time, true)},
      {"engines", "beside other engines: joints and spin", false, true, work(WorkFigure::engines, false)},
      {"engines-contacts", "beside other engines: contacts", false, true, work(WorkFigure::engines, true)},
      {"engine-steps", "beside other engines by step: joints and spin", true, true,
       work(WorkFigure::engine_steps, false)},
      {"engine-steps-contacts", "beside other engines by step: contacts", true, true,
       work(WorkFigure::engine_steps, true)},
      {"order", "error against the (sub-)step, with slope triangles", true, true, order_sheet},
      {"equal-rows", "sub-steps against iterations at equal row solves", true, true, equal_rows_sheet},
      {"map-steps", "map of n and h: error, bounded", true, true, step_map_sheet},
      {"map-factors", "map of τ and κ: error, bounded", true, true, factor_map_sheet},
      {"drift", "joint gaps, overlaps and energy over time", true, false, drift_sheet},
      {"mass-ratio", "validity: mass ratio against sub-steps", true, false, mass_ratio_sheet},
      {"stiffness", "validity: step against a spring's stiffness", true, false, stiffness_sheet},
      {"stability", "validity: τ against κ, with the closed form", true, false, stability_sheet},
      {"coupled-rows", "validity: growth of coupled rows in a sub-step, over τ and m", true, false,
       coupled_rows_sheet},
      {"ablation", "what each approximation from A3 to A5 costs", true, false, ablation_sheet},
      {"sweep-errors", "how row-by-row sweeps converge on friction problems of files", true, false,
       sweep_errors_sheet},
      {"size", "CPU time against the length of a chain", false, false, size_sheet},
      {"descendants-rows", "the report's algorithms beside Soft Step, XPBD and AVBD, by rows solved", true,
       true, descendants(Cost::rows)},
      {"descendants-time", "the report's algorithms beside Soft Step, XPBD and AVBD, by CPU time", false,
       true, descendants(Cost::time)},
      {"warm-start", "what a warm start of A5 is worth", true, true, warm_start_sheet},
      {"needed-substeps", "mass ratio against the sub-steps that hold it, for A1 to A5 and later algorithms",
       true, false, needed_substeps_sheet},
      {"avbd-stability", "AVBD over mass scale and β", true, false, avbd_stability_sheet},
      {"soft-rows", "τ and κ beside frequency and damping ratio", true, false, soft_rows_sheet}};
}

/// Returns the value with three digits, or "least to most" of several; "–" of none.
std::string range_text(const std::vector<double>& values) {
  if (values.empty()) return "–";
  const auto [least, most] = std::ranges::minmax(values);
  return least < most ? fmt::format("{:.3g} to {:.3g}", least, most) : fmt::format("{:.3g}", least);
}

TextTable numbers_of(const Panel& panel) {
  if (!panel.notes.empty()) {
    TextTable table{{panel.title, panel.x.title, panel.y.title}, {}};
    for (const Note& note : panel.notes)
      table.rows.push_back({note.text, range_text({note.x}), range_text({note.y})});
    return table;
  }
  TextTable table{{fmt::format("{}: {}", panel.title, panel.x.title)}, {}};
  std::map<double, std::vector<std::vector<double>>> rows;  // by x, by column
  const auto has_marks = [](const Series& series) { return series.style.points; };
  const bool has_borders = std::ranges::any_of(panel.series, has_marks);
  for (const Series& series : panel.series) {
    if (has_borders && !has_marks(series)) continue;  // a border
    for (const auto& [x, y] : series.points) {
      rows[x].resize(std::max(rows[x].size(), table.head.size()));
      rows[x].back().push_back(y);
    }
    table.head.push_back(series.title);
  }
  for (auto& [x, columns] : rows) {
    columns.resize(table.head.size() - 1);
    std::vector<std::string>& row = table.rows.emplace_back();
    row.push_back(range_text({x}));
    for (const std::vector<double>& values : columns) row.push_back(range_text(values));
  }
  return table;
}

std::string points_csv(const Sheet& sheet) {
  const auto quoted = [](std::string text) {
    for (std::size_t at = text.find('"'); at != std::string::npos; at = text.find('"', at + 2))
      text.insert(at, 1, '"');
    return fmt::format("\"{}\"", text);
  };
  std::string text = "panel,series,x_axis,y_axis,x,y,value\n";
  for (const Panel& panel : sheet.panels) {
    for (const Series& series : panel.series) {
      for (std::size_t i = 0; i < series.points.size(); ++i) {
        const auto& [x, y] = series.points[i];
        if (!can_be_drawn({x, y}, panel)) continue;
        const std::string value = i < series.values.size() ? fmt::format("{}", series.values[i]) : "";
        text += fmt::format("{},{},{},{},{},{},{}\n", quoted(panel.title), quoted(series.title),
                            quoted(panel.x.title), quoted(panel.y.title), x, y, value);
      }
    }
  }
  return text;
}

}  // namespace

Scene FigureSource::scene(const std::string& name) const {
  return load_scene(scenes / (name + ".gltf"));
}

const std::vector<ReportFigure>& figures() {
  static const std::vector<ReportFigure> all = all_figures();
  return all;
}

const ReportFigure& figure_named(const std::string& name) {
  const auto found = std::ranges::find(figures(), name, &ReportFigure::name);
  if (found != figures().end()) return *found;
  std::vector<std::string_view> names;
  for (const ReportFigure& figure : figures()) names.push_back(figure.name);
  throw Error("there is no figure '{}'; there are {}", name, fmt::join(names, " "));
}

std::vector<TextTable> numbers_of(const Sheet& sheet) {
  std::vector<TextTable> tables;
  for (const Panel& panel : sheet.panels) tables.push_back(numbers_of(panel));
  return tables;
}

RenderedFigure rendered(const Sheet& sheet, PictureFormat format, const FigureStyle& style) {
  return {draw(sheet, format, style), points_csv(sheet), caption_text(sheet), sheet.left_out};
}

}  // namespace substep::report
