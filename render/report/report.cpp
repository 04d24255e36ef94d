#include "render/report/report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "render/report/report_tables.h"
#include "sim/study/sweep_results.h"

namespace substep::embedded {
std::string_view report_md();
}  // namespace substep::embedded

namespace substep::report {
namespace {

/// Rendered figures by their names, without figures that have no data.
using Pictures = std::map<std::string, RenderedFigure>;

Pictures rendered_figures(const FigureSource& source, const std::function<void(double)>& progress) {
  Pictures pictures;
  for (const ReportFigure& figure : figures()) {
    if (progress) progress(static_cast<double>(pictures.size()) / static_cast<double>(figures().size()));
    if (!figure.from_sweep && !source.properties) continue;
    // Skip figures of other pages.
    if (embedded::report_md().find(fmt::format("![{}]", figure.name)) == std::string_view::npos) continue;
    const Sheet sheet = figure.make(source);
    // Skip figures for which the sweep has no data.
    if (!sheet.panels.empty()) pictures[figure.name] = rendered(sheet, PictureFormat::svg);
  }
  return pictures;
}

/// Returns the paragraphs of a text, each with its lines joined.
std::vector<std::string> paragraphs_of(std::string_view text) {
  std::vector<std::string> paragraphs(1);
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::string& last = paragraphs.back();
    if (!line.empty()) {
      last += (last.empty() ? "" : " ") + line;
    } else if (!last.empty()) {
      paragraphs.emplace_back();
    }
  }
  if (paragraphs.back().empty()) paragraphs.pop_back();
  return paragraphs;
}

/// Returns the table without empty columns.
TextTable without_empty_columns(const TextTable& table) {
  TextTable result;
  result.rows.resize(table.rows.size());
  for (std::size_t column = 0; column < table.head.size(); ++column) {
    const auto is_filled = [&](const std::vector<std::string>& row) { return !row[column].empty(); };
    if (column > 0 && std::ranges::none_of(table.rows, is_filled)) continue;
    result.head.push_back(table.head[column]);
    for (std::size_t row = 0; row < table.rows.size(); ++row)
      result.rows[row].push_back(table.rows[row][column]);
  }
  return result;
}

/// Fills in report.md: {numbers}, ![figures] and [tables of the records]. A paragraph that begins with (if
/// CONDITION) is kept where the condition holds, one that ends with a colon where a figure or table follows.
/// A section whose figures and tables are all empty is removed with its heading and text.
class Report {
 public:
  Report(const FigureSource& source, Pictures pictures)
      : source_(source), records_(source.records), pictures_(std::move(pictures)) {
    for (const std::string& scene : scenes_of(records_)) conditions_.insert(scene);
    if (!equal_rows_.table.rows.empty()) conditions_.insert("equal rows");
    if (has_times(records_)) conditions_.insert("times");
  }

  Document page() {
    for (const std::string& paragraph : paragraphs_of(embedded::report_md())) add(paragraph);
    end_section();
    return std::move(page_);
  }

 private:
  void add(const std::string& paragraph) {
    constexpr std::string_view condition = "(if ";
    if (paragraph.starts_with('#')) {
      end_section();
      const std::size_t level = paragraph.find(' ');
      section_ = page_.blocks.size();
      page_.heading(static_cast<int>(level), paragraph.substr(level + 1));
    } else if (paragraph.starts_with('!') || paragraph.starts_with('[')) {
      const std::size_t before = page_.blocks.size();
      if (paragraph.starts_with('!')) {
        picture(paragraph.substr(2, paragraph.size() - 3));
      } else {
        contents_.at(paragraph.substr(1, paragraph.size() - 2))();
      }
      ++expected_blocks_;
      if (page_.blocks.size() == before) return;
      ++added_blocks_;
      if (introduction_.empty()) return;
      page_.blocks.insert(page_.blocks.begin() + before, {.kind = Document::Block::Kind::paragraph,
                                                          .text = std::exchange(introduction_, "")});
    } else if (paragraph.starts_with(condition)) {
      const std::size_t end = paragraph.find(')');
      if (conditions_.contains(paragraph.substr(condition.size(), end - condition.size())))
        add(paragraph.substr(end + 2));
    } else {
      introduction_ = filled(paragraph);
      if (!introduction_.ends_with(':')) page_.paragraph(std::exchange(introduction_, ""));
    }
  }

  /// Removes the section where all of its figures and tables are empty.
  void end_section() {
    if (expected_blocks_ > 0 && added_blocks_ == 0) page_.blocks.resize(section_);
    expected_blocks_ = added_blocks_ = 0;
    introduction_.clear();
  }

  void picture(const std::string& name) {
    if (!pictures_.contains(name)) return;
    add_figure(figure_named(name).about, name, pictures_.at(name));
  }

  void add_figure(const std::string& about, const std::string& name, const RenderedFigure& figure) {
    page_.picture(about, fmt::format("figures/{}.svg", name), figure.picture,
                  {{".csv", figure.points}, {".txt", figure.caption}});
  }

  void table(const TextTable& given) {
    const TextTable rows = without_empty_columns(given);
    if (!rows.rows.empty() && rows.head.size() > 1) page_.table(rows);
  }

  std::string filled(const std::string& paragraph) const {
    const std::vector<std::string>& won = equal_rows_.won_on;
    const std::vector<std::string>& lost = equal_rows_.not_won_on;
    return fmt::format(
        fmt::runtime(paragraph),
        fmt::arg("runs", counted(std::ranges::count(records_, "", &SweepRecord::omitted), "run")),
        fmt::arg("scenes", counted(scenes_of(records_).size(), "scene")), fmt::arg("won", won.size()),
        fmt::arg("compared", won.size() + lost.size()),
        fmt::arg("won_scenes", won.empty() ? "" : fmt::format(": {}", fmt::join(won, ", "))),
        fmt::arg("lost_scenes", lost.empty() ? "" : fmt::format(" Not on {}.", fmt::join(lost, ", "))),
        fmt::arg("equal_cost", equal_cost_factor));
  }

  /// Adds a section of the measured values that miss a known one, if there are any.
  void worst_values() {
    const std::vector<BadFigure> missed = bad_figures(records_);
    if (missed.empty()) return;
    page_.heading(2, "Missed values");
    page_.paragraph(fmt::format(
        "The scenes' known values (closed forms, invariants, bodies that must stand) that runs miss by more "
        "than the tolerance. Compared over the whole duration: {}. Each line has the worst value of "
        "one scene and algorithm over all settings, coarse ones included. Algorithms that "
        "miss the same share a line. The last column has the number of settings that miss it.",
        counted(judged_runs(records_), "run")));
    page_.table(bad_figures_table(missed));
  }

  /// Adds a card for each scene with the chosen runs, their curve and a picture; for many scenes a table.
  void choices() {
    const std::vector<std::string> scenes = scenes_of(records_);
    if (scenes.size() > most_cards) return table(choices_table(records_));
    for (const std::string& scene : scenes) {
      const std::vector<SweepRecord> own = of_scene(records_, scene);
      if (std::ranges::none_of(own, is_own_run)) continue;
      page_.begin_card();
      page_.heading(3, scene);
      page_.table(choice_table(own));
      const Sheet sheet = choice_sheet(own);
      if (!sheet.panels.empty()) {
        FigureStyle style;
        style.title = style.caption = false;
        add_figure(sheet.title, "choice-" + scene, rendered(sheet, PictureFormat::svg, style));
      }
      if (const auto still = source_.stills.find(scene); still != source_.stills.end()) {
        page_.picture(
            fmt::format("{}: A1 to A5 at {:g} s, at their default settings", scene, own.front().duration),
            fmt::format("figures/end-{}.png", scene), still->second);
      }
      page_.end_card();
    }
  }

  void advice_for_scenes() {
    for (const std::string& scene : scenes_of(records_)) {
      const std::vector<SweepRecord> own = of_scene(records_, scene);
      if (std::ranges::none_of(own, is_own_run)) continue;
      page_.heading(3, scene);
      page_.paragraph(advice(own));
      const TextTable best = runs_table(best_runs(own));
      if (best.rows.empty()) continue;
      page_.paragraph("The runs that err by a fifth less than every cheaper one:");
      table(best);
    }
  }

  void descendants(Cost cost) {
    for (const TextTable& each : equal_cost_of_descendants(records_, cost)) table(each);
  }

  void omitted() {
    std::vector<LeftOut> left_out;
    for (const auto& [name, figure] : pictures_)
      left_out.insert(left_out.end(), figure.left_out.begin(), figure.left_out.end());
    table(omitted_table(records_, left_out));
  }

  const FigureSource& source_;
  const std::vector<SweepRecord>& records_;
  const Pictures pictures_;
  const EqualRows equal_rows_ = equal_rows(records_);
  std::set<std::string> conditions_;  ///< true ones: names of scenes, and those the constructor adds
  Document page_;
  std::size_t section_ = 0;   ///< index of the block of the template's last heading
  int expected_blocks_ = 0;   ///< figures and tables that the section's template names
  int added_blocks_ = 0;      ///< those that have data
  std::string introduction_;  ///< paragraph that ends with a colon, until a figure or table follows
  /// Functions for the tables in brackets in the template.
  const std::map<std::string, std::function<void()>> contents_{
      {"worst figures", [this] { worst_values(); }},
      {"choices", [this] { choices(); }},
      {"equal cost", [this] { table(equal_cost_table(records_)); }},
      {"orders", [this] { table(orders_table(records_)); }},
      {"equal rows", [this] { table(equal_rows_.table); }},
      {"limits", [this] { table(limits_table(records_, false)); }},
      {"limits with contacts", [this] { table(limits_table(records_, true)); }},
      {"energy", [this] { table(energy_table(records_)); }},
      {"springs", [this] { table(source_.properties ? springs_table() : TextTable()); }},
      {"advice for each scene", [this] { advice_for_scenes(); }},
      {"references", [this] { table(references_table(records_)); }},
      {"engines", [this] { table(engines_table(records_)); }},
      {"ahead", [this] { table(ahead_table(records_)); }},
      {"descendants by rows", [this] { descendants(Cost::rows); }},
      {"descendants by time", [this] { descendants(Cost::time); }},
      {"omitted", [this] { omitted(); }},
  };
};

}  // namespace

Document report_page(const FigureSource& source, const std::map<std::string, RenderedFigure>& pictures) {
  return Report(source, pictures).page();
}

Document make_report(const FigureSource& source, const std::function<void(double)>& progress) {
  return report_page(source, rendered_figures(source, progress));
}

}  // namespace substep::report
