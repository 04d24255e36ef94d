#include "render/report/bad_figures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

namespace substep::report {
namespace {

bool is_judged(const SweepRecord& record) {
  return record.engine.empty() && record.metrics && !record.metrics->expected.empty();
}

std::string expected_text(const ExpectedFigure& x) {
  const char* const sign = x.bound == Bound::at_most ? "≤ " : x.bound == Bound::at_least ? "≥ " : "";
  return fmt::format("{}{} {}", sign, short_number(x.expected), x.unit);
}

std::string measured_text(const ExpectedFigure& x) {
  return std::isfinite(x.measured) ? fmt::format("{} {}", short_number(x.measured), x.unit) : "never";
}

std::string severity_text(double severity) {
  return std::isfinite(severity) ? fmt::format("{:.2g} times", severity) : "all";
}

}  // namespace

std::vector<BadFigure> bad_figures(const std::vector<SweepRecord>& records) {
  std::map<std::pair<std::string, Algorithm>, BadFigure> worst;
  for (const SweepRecord& record : records) {
    if (!is_judged(record)) continue;
    BadFigure& own = worst[{record.scene, record.settings.algorithm}];
    ++own.runs;
    own.bad += std::ranges::any_of(record.metrics->expected, &ExpectedFigure::is_bad) ? 1 : 0;
    for (const ExpectedFigure& figure : record.metrics->expected) {
      BadFigure candidate{record.scene, record.settings.algorithm, record.label, figure, own.bad, own.runs};
      if (!own.scene.empty() && !(candidate.severity() > own.severity())) {
        continue;
      }
      own = std::move(candidate);
    }
  }
  std::vector<BadFigure> result;
  for (auto& [place, figure] : worst) {
    if (figure.bad > 0) result.push_back(std::move(figure));
  }
  std::ranges::stable_sort(result, [](const BadFigure& a, const BadFigure& b) {
    if (a.severity() != b.severity()) return a.severity() > b.severity();
    return static_cast<double>(a.bad) / a.runs > static_cast<double>(b.bad) / b.runs;
  });
  return result;
}

int judged_runs(const std::vector<SweepRecord>& records) {
  return static_cast<int>(std::ranges::count_if(records, is_judged));
}

TextTable bad_figures_table(const std::vector<BadFigure>& figures) {
  TextTable table{{"scene", "algorithm", "worst figure", "expected", "measured", "off by, in tolerances",
                   "with", "settings with a bad figure"},
                  {}};
  std::vector<const BadFigure*> shown;
  for (const BadFigure& x : figures) {
    const auto is_same = [&](const BadFigure* other) {
      return other->scene == x.scene && other->figure.name == x.figure.name;
    };
    // The worst of the algorithms that miss the same has the line.
    if (std::ranges::any_of(shown, is_same)) continue;
    shown.push_back(&x);
    std::vector<std::string_view> algorithms;
    int bad = 0;
    int runs = 0;
    for (const BadFigure& other : figures) {
      if (!is_same(&other)) continue;
      algorithms.push_back(title_of(other.algorithm));
      bad += other.bad;
      runs += other.runs;
    }
    table.rows.push_back({x.scene, fmt::format("{}", fmt::join(algorithms, ", ")), x.figure.name,
                          expected_text(x.figure), measured_text(x.figure), severity_text(x.severity()),
                          x.label, fmt::format("{} of {}", bad, runs)});
  }
  return table;
}

void add_bad_figures(const std::vector<SweepRecord>& records, Document& page) {
  const std::vector<BadFigure> figures = bad_figures(records);
  if (figures.empty()) return;
  page.heading(2, "What is off");
  page.paragraph(fmt::format(
      "What is known of the scenes (closed forms, invariants, what must stand) and does not hold within its "
      "tolerance over the whole duration, in {} runs that were compared: of each scene and algorithm the "
      "worst "
      "figure of all settings that ran, the worst first, and one line for the algorithms that miss the same. "
      "What ran and is not here has none. "
      "Coarse settings are among those that ran: the last column says how many of them are off.",
      judged_runs(records)));
  page.table(bad_figures_table(figures));
}

}  // namespace substep::report
