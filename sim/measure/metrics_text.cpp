// One file, since the short tables and those of every metric share their cells.

#include "sim/measure/metrics_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "sim/model/settings_fields.h"

namespace substep {
namespace {

std::string optional_number(const std::optional<double>& value) {
  return value ? short_number(*value) : "";
}

constexpr double smallest_error = 1e-12;  // m, rad: above the arithmetic's rounding

/// Returns an error, with ≈ where it is at least `smallest_error` and below 100 uncertainties of the
/// reference.
std::string error_number(double value, double uncertainty) {
  const bool is_certain = !(value >= smallest_error) || value >= 100 * uncertainty;
  return fmt::format("{}{}", is_certain ? "" : "≈", short_number(value));
}

/// Returns "A3" of an algorithm.
std::string short_label(const MeasuredSettings& run) {
  return run.author.empty() ? label(run).substr(0, 2) : run.author;
}

/// Returns the count; nothing for a run of another program.
std::string row_solves_text(const MeasuredSettings& run) {
  return run.author.empty() ? std::to_string(run.metrics.row_solves) : "";
}

TextTable errors_of(const SceneMeasurement& m) {
  TextTable table{
      {"", "RMS, m", "/ size", "largest, m", "RMS turn, rad", "largest turn, rad", "step error, m",
       "solver error, m", "model error, m", "(sub-)step residual, m/s", "row solves"},
      {}};
  for (const MeasuredSettings& run : m.runs) {
    const Metrics& x = run.metrics;
    table.rows.push_back({label(run), error_number(x.error.position.rms, m.reference.uncertainty().position),
                          short_number(x.error.position.rms / m.size),
                          error_number(x.error.position.largest, m.reference.uncertainty().position),
                          error_number(x.error.orientation.rms, m.reference.uncertainty().turn),
                          error_number(x.error.orientation.largest, m.reference.uncertainty().turn),
                          error_number(x.parts.stepping, m.reference.uncertainty().position),
                          optional_number(x.parts.solver), optional_number(x.parts.model),
                          short_number(x.residual.rms), row_solves_text(run)});
  }
  return table;
}

std::string verdict(const Metrics& metrics) {
  if (metrics.diverged) return fmt::format("diverged at {:.3g} s", *metrics.diverged);
  return metrics.bounded ? "yes" : "no";
}

TextTable invariants_of(const SceneMeasurement& m) {
  const bool is_free = m.runs.front().metrics.momentum.has_value();
  TextTable table{{"", "joint gap, m", "penetration, m", "energy, J: end − start", "largest rise"}, {}};
  if (is_free) table.head.insert(table.head.end(), {"momentum, N·s", "angular, N·m·s"});
  table.head.push_back("bounded");
  for (const MeasuredSettings& run : m.runs) {
    const Metrics& x = run.metrics;
    std::vector<std::string> row{label(run), short_number(x.joint_gap), short_number(x.penetration),
                                 short_number(x.energy_change), short_number(x.energy_growth)};
    if (is_free) row.insert(row.end(), {optional_number(x.momentum), optional_number(x.angular_momentum)});
    row.push_back(verdict(x));
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Returns a number of five digits: periods may differ in the third.
std::string figure_number(double value) {
  if (!(std::abs(value) < 1e9) || std::abs(value) < 1e-12) return short_number(value);
  return fmt::format("{:.5g}", value);
}

/// Returns a line for each figure, with the value and the error of each run; ! marks bad errors.
TextTable expectations_of(const SceneMeasurement& m) {
  TextTable table{{"known figure, over the whole duration", "expected", "±"}, {}};
  for (const MeasuredSettings& run : m.runs) {
    const std::string algorithm = short_label(run);
    table.head.insert(table.head.end(), {algorithm, "error"});
  }
  for (std::size_t i = 0; i < m.runs.front().metrics.expected.size(); ++i) {
    const ExpectedFigure& first = m.runs.front().metrics.expected[i];
    std::vector<std::string> row{fmt::format("{}, {}", first.name, first.unit),
                                 bounded_text(first.bound, figure_number(first.expected)),
                                 short_number(first.tolerance)};
    for (const MeasuredSettings& run : m.runs) {
      const ExpectedFigure& x = run.metrics.expected[i];
      row.push_back(figure_number(x.measured));
      row.push_back(short_number(x.error()) + (x.is_bad() ? " !" : ""));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

bool has_expectations(const SceneMeasurement& m) {
  return !m.runs.empty() && !m.runs.front().metrics.expected.empty();
}

bool has_times(const SceneMeasurement& m) {
  return !m.runs.empty() && m.runs.front().times.has_value();
}

TextTable times_of(const SceneMeasurement& m) {
  TextTable table{{"", "CPU time, ms", "least", "most", "s1, µs a step", "s2", "s3", "s4"}, {}};
  for (const MeasuredSettings& run : m.runs) {
    const RunTimes& t = *run.times;
    const auto ms = [](double seconds) { return fmt::format("{:.3g}", 1000 * seconds); };
    const auto us = [](double time) { return fmt::format("{:.3g}", time); };
    table.rows.push_back({label(run), ms(t.median), ms(t.smallest), ms(t.largest), us(t.stages.geometry),
                          us(t.stages.formulation), us(t.stages.velocities), us(t.stages.coordinates)});
  }
  return table;
}

std::string heading(const SceneMeasurement& m) {
  return fmt::format(
      "{}: {}\nReference: {}; turns are uncertain by {} rad. Errors are until then, over all moving\nbodies; "
      "≈: less than 100 times the uncertainty. Scene's size: {:.3g} m; invariants over {:g} s.\n",
      m.scene, m.modelled, reference_text(m.reference), short_number(m.reference.uncertainty().turn), m.size,
      m.duration);
}

std::string all_tables(const SceneMeasurement& m, bool as_markdown) {
  std::string text = fmt::format("{}\n{}\n{}", heading(m), to_text(errors_of(m), as_markdown),
                                 to_text(invariants_of(m), as_markdown));
  if (has_expectations(m)) {
    text += fmt::format("\n{}\n!: off by more than ±; –: never happened, or the run diverged before.\n",
                        to_text(expectations_of(m), as_markdown));
  }
  if (has_times(m)) text += fmt::format("\n{}", to_text(times_of(m), as_markdown));
  return text;
}

/// Returns n, all settings of A2, and further ones that differ from the algorithm's defaults, each after a
/// blank, without the step: " n=4".
std::string settings_label(const Settings& settings) {
  const std::vector<SettingsPart> usual = parts_of(default_settings(settings.algorithm));
  std::string text;
  for (const SettingsPart& part : parts_of(settings)) {
    if (part.field->name == "step") continue;
    const bool is_usual = std::ranges::find(usual, part.text, &SettingsPart::text) != usual.end();
    const bool is_always_printed = part.field->name == "substeps" || settings.algorithm == Algorithm::a2;
    if (!is_usual || is_always_printed) text += " " + part.text;
  }
  return text;
}

bool has_each_algorithm_once(const SceneMeasurement& m) {
  if (!m.runs.front().author.empty()) return false;
  for (std::size_t i = 1; i < m.runs.size(); ++i) {
    if (m.runs[i].settings.algorithm <= m.runs[i - 1].settings.algorithm) return false;
  }
  return true;
}

/// Returns "h=1/60, n=10." where all runs have the same n (A2: m) and else defaults; otherwise the step and
/// each group's settings: "h=1/60. A2: m=200. A3 to A5: n=10.".
std::string settings_line(const SceneMeasurement& m) {
  const std::string step = parts_of(m.runs.front().settings).back().text;
  const int substeps = m.runs.back().settings.substeps;
  const auto is_usual = [&](const MeasuredSettings& run) {
    const std::string settings = settings_label(run.settings);
    return settings.empty() || settings == fmt::format(" n={}", substeps) ||
           (run.settings.algorithm == Algorithm::a2 && settings == fmt::format(" m={}", substeps));
  };
  if (std::ranges::all_of(m.runs, is_usual)) return fmt::format("{}, n={}.\n", step, substeps);
  std::string text = step + ".";
  for (std::size_t first = 0; first < m.runs.size();) {
    const std::string settings = settings_label(m.runs[first].settings);
    std::size_t last = first;
    while (last + 1 < m.runs.size() && settings_label(m.runs[last + 1].settings) == settings) ++last;
    if (!settings.empty()) {
      text += fmt::format(" {}", label(m.runs[first].settings).substr(0, 2));
      if (last > first) text += fmt::format(" to {}", label(m.runs[last].settings).substr(0, 2));
      text += fmt::format(":{}.", settings);
    }
    first = last + 1;
  }
  text += '\n';
  return text;
}

/// A column of the short table: the larger its rank, the sooner it is left out.
struct Column {
  int rank;
  std::string head;
  std::function<std::string(const MeasuredSettings&)> cell;
};

constexpr std::size_t most_columns = 7;

bool is_all_bounded(const SceneMeasurement& m) {
  return std::ranges::all_of(m.runs, [](const MeasuredSettings& run) { return run.metrics.bounded; });
}

/// Returns at most six columns: row solves (`settings_in_rows`), CPU time, errors, and gaps, overlaps, motion
/// and energy rise where a run has any; `bounded` where a run is not. Errors of turns are among them where no
/// bodies are joined or touch, or a run errs far more in turns than in centres.
std::vector<Column> columns_of(const SceneMeasurement& m, bool settings_in_rows) {
  std::vector<Column> columns;
  const auto add = [&](int rank, std::string head, std::function<std::string(const MeasuredSettings&)> cell) {
    columns.push_back({rank, std::move(head), std::move(cell)});
  };
  const auto add_positive = [&](int rank, const char* head, double Metrics::*value) {
    const auto is_positive = [&](const MeasuredSettings& run) { return run.metrics.*value > 0; };
    if (std::ranges::any_of(m.runs, is_positive))
      add(rank, head, [value](const MeasuredSettings& run) { return short_number(run.metrics.*value); });
  };
  if (settings_in_rows && m.runs.front().author.empty()) add(0, "row solves", row_solves_text);
  if (has_times(m)) {
    add(0, "CPU, ms a simulated second", [&m](const MeasuredSettings& run) {
      return fmt::format("~{:.2g}", 1000 * run.times->median / m.duration);
    });
  }
  // Leave the error out where the reference stands still: `moved` covers the whole duration.
  if (!m.stands && m.reference.horizon > 0) {
    add(0, settings_in_rows ? fmt::format("RMS error to {:.3g} s, m", m.reference.horizon) : "RMS error, m",
        [&m](const MeasuredSettings& run) {
          return error_number(run.metrics.error.position.rms, m.reference.uncertainty().position);
        });
  }
  const auto touches = [](const MeasuredSettings& run) {
    return run.metrics.joint_gap > 0 || run.metrics.penetration > 0;
  };
  const auto turns_in_place = [&m](const MeasuredSettings& run) {
    const MotionDifference& error = run.metrics.error;
    return error.orientation.rms >= smallest_error &&
           error.position.rms < 1e-4 * m.size * error.orientation.rms;
  };
  const bool is_apart = std::ranges::none_of(m.runs, touches);
  if (is_apart || std::ranges::any_of(m.runs, turns_in_place)) {
    add(is_apart ? 0 : 1, "RMS turn, rad", [&m](const MeasuredSettings& run) {
      return error_number(run.metrics.error.orientation.rms, m.reference.uncertainty().turn);
    });
  }
  add_positive(0, "joint gap, m", &Metrics::joint_gap);
  add_positive(0, "overlap, m", &Metrics::penetration);
  if (m.stands) add_positive(1, "moved, m", &Metrics::moved);
  // Ignore rises of up to a hundredth of the scene's energy scale, which every step size has.
  const auto gains = [](const MeasuredSettings& run) {
    return run.metrics.energy_growth > 0.01 * run.metrics.energy_scale;
  };
  if (!m.driven && std::ranges::any_of(m.runs, gains))
    add_positive(2, "energy rise, J", &Metrics::energy_growth);
  add(0, "bounded", [](const MeasuredSettings& run) { return verdict(run.metrics); });
  while (columns.size() + 1 > most_columns) {
    const auto last = std::ranges::max_element(columns, {}, &Column::rank);
    if (last->rank == 0) break;
    columns.erase(last);
  }
  if (is_all_bounded(m)) columns.pop_back();
  return columns;
}

TextTable short_table(const SceneMeasurement& m, bool settings_in_rows) {
  TextTable table{{""}, {}};
  const std::vector<Column> columns = columns_of(m, settings_in_rows);
  for (const Column& column : columns) table.head.push_back(column.head);
  for (const MeasuredSettings& run : m.runs) {
    std::vector<std::string> row{settings_in_rows ? label(run) : short_label(run)};
    for (const Column& column : columns) row.push_back(column.cell(run));
    // Runs with equal numbers share a row: "A4, A5" or "A3 to A5".
    if (!settings_in_rows && !table.rows.empty() &&
        std::equal(row.begin() + 1, row.end(), table.rows.back().begin() + 1)) {
      std::string& name = table.rows.back().front();
      name = fmt::format("{}{}{}", name.substr(0, 2), name.size() == 2 ? ", " : " to ", row.front());
    } else {
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

/// Returns the largest error of the runs, relative to the figure's tolerance.
double worst_ratio(const SceneMeasurement& m, std::size_t figure) {
  double worst = 0;
  for (const MeasuredSettings& run : m.runs) {
    const ExpectedFigure& x = run.metrics.expected[figure];
    worst = std::max(worst, x.error() / x.tolerance);
  }
  return worst;
}

/// Returns the figures that a run misses by more than their tolerance, the worst first.
std::vector<std::size_t> missed_figures(const SceneMeasurement& m) {
  std::vector<std::size_t> figures;
  for (std::size_t figure = 0; figure < m.runs.front().metrics.expected.size(); ++figure) {
    if (worst_ratio(m, figure) > 1) figures.push_back(figure);
  }
  std::ranges::stable_sort(figures, std::greater{},
                           [&](std::size_t figure) { return worst_ratio(m, figure); });
  return figures;
}

/// Returns a row for each of the figures: the error of each run, with ! where it is beyond the tolerance.
TextTable errors_of_expectations(const SceneMeasurement& m, const std::vector<std::size_t>& figures) {
  TextTable table{{"error in", "expected"}, {}};
  for (const MeasuredSettings& run : m.runs) table.head.push_back(short_label(run));
  for (const std::size_t figure : figures) {
    const ExpectedFigure& first = m.runs.front().metrics.expected[figure];
    const char* const bound = first.bound == Bound::at_most ? "≤" : first.bound == Bound::at_least ? "≥" : "";
    std::vector<std::string> row{fmt::format("{}, {}", first.name, first.unit),
                                 fmt::format("{}{}", bound, short_number(first.expected))};
    for (const MeasuredSettings& run : m.runs) {
      const ExpectedFigure& x = run.metrics.expected[figure];
      row.push_back(short_number(x.error()) + (x.is_bad() ? "!" : ""));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Returns the missed figures as a table of at most the four worst, and how many figures are missed.
std::string known_figures(const SceneMeasurement& m, bool as_markdown) {
  constexpr std::size_t most = 4;
  const std::size_t all = m.runs.front().metrics.expected.size();
  std::vector<std::size_t> figures = missed_figures(m);
  const std::size_t missed = figures.size();
  if (missed == 0) return fmt::format("\nKnown figures: {}, all within tolerance.\n", all);
  figures.resize(std::min(missed, most));
  return fmt::format("\n{}\nMissed (!): {} of {} known figures.\n",
                     to_text(errors_of_expectations(m, figures), as_markdown), missed, all);
}

/// Explains the signs ≈ and – where they stand in the text.
std::string legend(const std::string& text) {
  std::string signs;
  if (text.find("≈") != std::string::npos) signs += "≈: below 100 uncertainties. ";
  if (text.find("–") != std::string::npos) signs += "–: diverged, or never happened. ";
  if (signs.empty()) return signs;
  signs.back() = '\n';
  return fmt::format("\n{}", signs);
}

std::string short_tables(const SceneMeasurement& m, bool as_markdown) {
  const bool is_plain = has_each_algorithm_once(m);
  std::string text = m.stands ? "" : fmt::format("Reference: {}. ", reference_text(m.reference, false));
  text += fmt::format("Duration {:g} s{}.\n", m.duration, is_all_bounded(m) ? ", all bounded" : "");
  if (is_plain) text += settings_line(m);
  text += fmt::format("\n{}", to_text(short_table(m, !is_plain), as_markdown));
  if (has_expectations(m) && m.runs.size() + 2 <= most_columns) text += known_figures(m, as_markdown);
  return text + legend(text);
}

}  // namespace

std::string reference_text(const ReferenceMotion& reference, bool names_method) {
  if (reference.horizon == 0) {
    return fmt::format("none: {} and half its steps diverge at once, at {}", reference.method,
                       reference.divergence_point);
  }
  std::string text = names_method ? reference.method + ", " : "";
  text += fmt::format("uncertain by {} m until {:.3g} s", short_number(reference.uncertainty().position),
                      reference.horizon);
  if (!reference.divergence_point.empty())
    text += fmt::format(", when {} diverges", reference.divergence_point);
  return text;
}

std::string label(const MeasuredSettings& run) {
  return run.author.empty() ? label(run.settings) : run.author;
}

std::string to_text(const SceneMeasurement& measurement, bool all, bool as_markdown) {
  return all ? all_tables(measurement, as_markdown) : short_tables(measurement, as_markdown);
}

TextTable brief_table(const SceneMeasurement& measurement) {
  return short_table(measurement, true);
}

}  // namespace substep
