#include "sim/measure/metrics_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sim/measure/metrics_json.h"
#include "sim/measure/text_table.h"

namespace substep {
namespace {

using Json = nlohmann::ordered_json;

std::string optional_number(const std::optional<double>& value) {
  return value ? short_number(*value) : "";
}

/// An error; ≈ where a hundredth of it is less than what the reference itself may be off by.
std::string error_number(double value, double uncertainty) {
  constexpr double rounding = 1e-12;
  const bool is_sure = !(value >= rounding) || value >= 100 * uncertainty;
  return fmt::format("{}{}", is_sure ? "" : "≈", short_number(value));
}

TextTable errors_of(const SceneMeasurement& m) {
  TextTable table{{"", "RMS, m", "/ size", "largest, m", "turn, rad", "largest", "of it: step", "solver",
                   "model", "a (sub-)step's residual, m/s", "row solves"},
                  {}};
  for (const MeasuredSettings& run : m.runs) {
    const Metrics& x = run.metrics;
    table.rows.push_back({label(run.settings), error_number(x.error.position.rms, m.reference.uncertainty),
                          short_number(x.error.position.rms / m.size),
                          error_number(x.error.position.largest, m.reference.uncertainty),
                          error_number(x.error.orientation.rms, m.reference.turn_uncertainty),
                          error_number(x.error.orientation.largest, m.reference.turn_uncertainty),
                          error_number(x.parts.stepping, m.reference.uncertainty),
                          optional_number(x.parts.solver), optional_number(x.parts.model),
                          short_number(x.residual.rms), std::to_string(x.row_solves)});
  }
  return table;
}

std::string verdict(const Metrics& metrics) {
  if (metrics.diverged) return fmt::format("blows up at {:.3g} s", *metrics.diverged);
  return metrics.bounded ? "yes" : "no";
}

TextTable invariants_of(const SceneMeasurement& m) {
  const bool is_free = m.runs.front().metrics.momentum.has_value();
  TextTable table{{"", "joint gap, m", "penetration, m", "energy, J: end − start", "largest rise"}, {}};
  if (is_free) table.head.insert(table.head.end(), {"momentum, N·s", "angular, N·m·s"});
  table.head.push_back("bounded");
  for (const MeasuredSettings& run : m.runs) {
    const Metrics& x = run.metrics;
    std::vector<std::string> row{label(run.settings), short_number(x.joint_gap), short_number(x.penetration),
                                 short_number(x.energy_change), short_number(x.energy_growth)};
    if (is_free) row.insert(row.end(), {optional_number(x.momentum), optional_number(x.angular_momentum)});
    row.push_back(verdict(x));
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Five digits: a period may differ in the third.
std::string figure_number(double value) {
  if (!(std::abs(value) < 1e9) || std::abs(value) < 1e-12) return short_number(value);
  return fmt::format("{:.5g}", value);
}

std::string expected_text(const ExpectedFigure& x) {
  const std::string value = figure_number(x.expected);
  if (x.bound == Bound::at_most) return "≤ " + value;
  return x.bound == Bound::at_least ? "≥ " + value : value;
}

/// A line for each figure; of each run its value and its error, with ! where that is bad.
TextTable expectations_of(const SceneMeasurement& m) {
  TextTable table{{"known for the whole duration", "expected", "±"}, {}};
  for (const MeasuredSettings& run : m.runs) {
    const std::string algorithm = label(run.settings).substr(0, 2);
    table.head.insert(table.head.end(), {algorithm, "error"});
  }
  for (std::size_t i = 0; i < m.runs.front().metrics.expected.size(); ++i) {
    const ExpectedFigure& first = m.runs.front().metrics.expected[i];
    std::vector<std::string> row{fmt::format("{}, {}", first.name, first.unit), expected_text(first),
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
    table.rows.push_back({label(run.settings), ms(t.median), ms(t.smallest), ms(t.largest),
                          us(t.stages.geometry), us(t.stages.formulation), us(t.stages.velocities),
                          us(t.stages.coordinates)});
  }
  return table;
}

std::string heading(const SceneMeasurement& m) {
  return fmt::format(
      "{}: {}\nReference: {}. Errors are until then, over all moving\nbodies; ≈: less than 100 times the "
      "uncertainty. Scene's size: {:.3g} m; invariants over {:g} s.\n",
      m.scene, m.modelled, reference_text(m.reference), m.size, m.duration);
}

template <typename Print>
std::string with_tables(const SceneMeasurement& m, const Print& print) {
  std::string text = fmt::format("{}\n{}\n{}", heading(m), print(errors_of(m)), print(invariants_of(m)));
  if (has_expectations(m)) {
    text += fmt::format("\n{}\n!: off by more than ±; –: never, or the run blew up before.\n",
                        print(expectations_of(m)));
  }
  if (has_times(m)) text += fmt::format("\n{}", print(times_of(m)));
  return text;
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
}  // namespace

std::string reference_text(const ReferenceMotion& reference) {
  if (reference.horizon == 0) {
    return fmt::format("none: {} and half its steps part at once, at {}", reference.method,
                       reference.divergence_point);
  }
  std::string text = fmt::format("{}; itself uncertain by {} m and {} rad until {:g} s", reference.method,
                                 short_number(reference.uncertainty),
                                 short_number(reference.turn_uncertainty), reference.horizon);
  if (!reference.divergence_point.empty())
    text += fmt::format(", when its refinements part at {}", reference.divergence_point);
  return text;
}

std::string to_table(const SceneMeasurement& measurement) {
  return with_tables(measurement, [](const TextTable& table) { return to_text(table); });
}

std::string to_markdown(const SceneMeasurement& measurement) {
  return with_tables(measurement, [](const TextTable& table) { return to_markdown(table); });
}

TextTable brief_table(const SceneMeasurement& m) {
  const auto any = [&](double Metrics::*value) {
    return std::ranges::any_of(m.runs, [&](const MeasuredSettings& run) { return run.metrics.*value > 0; });
  };
  TextTable table{{"", "row solves"}, {}};
  if (has_times(m)) table.head.push_back("CPU, ms a simulated second");
  table.head.push_back(fmt::format("RMS error to {:.3g} s, m", m.reference.horizon));
  if (any(&Metrics::joint_gap)) table.head.push_back("joint gap, m");
  if (any(&Metrics::penetration)) table.head.insert(table.head.end(), {"overlap, m", "moved, m"});
  table.head.push_back("bounded");
  for (const MeasuredSettings& run : m.runs) {
    const Metrics& x = run.metrics;
    std::vector<std::string> row{label(run.settings), std::to_string(x.row_solves)};
    if (has_times(m)) row.push_back(fmt::format("~{:.2g}", 1000 * run.times->median / m.duration));
    row.push_back(error_number(x.error.position.rms, m.reference.uncertainty));
    if (any(&Metrics::joint_gap)) row.push_back(short_number(x.joint_gap));
    if (any(&Metrics::penetration))
      row.insert(row.end(), {short_number(x.penetration), short_number(x.moved)});
    row.push_back(verdict(x));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string to_json(const SceneMeasurement& m) {
  Json runs = Json::array();
  for (const MeasuredSettings& run : m.runs) {
    Json entry{{"algorithm", name(run.settings.algorithm)}, {"label", label(run.settings)}};
    entry.update(to_json(run.metrics));
    if (run.times) entry["times"] = to_json(*run.times);
    runs.push_back(std::move(entry));
  }
  const Json reference{{"method", m.reference.method},
                       {"uncertainty", number(m.reference.uncertainty)},
                       {"turn_uncertainty", number(m.reference.turn_uncertainty)},
                       {"horizon", m.reference.horizon}};
  return Json{{"scene", m.scene},       {"size", m.size},         {"duration", m.duration},
              {"modelled", m.modelled}, {"reference", reference}, {"runs", runs}}
             .dump(2) +
         "\n";
}

}  // namespace substep
