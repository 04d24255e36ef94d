#include "sim/study/sweep_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/measure/text_table.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

std::string price_text(const SweepRecord& record) {
  if (record.times) return fmt::format("{:.2g} ms of CPU a simulated second", 1000 * cpu_time_of(record));
  return fmt::format(
      "{} rows a simulated second",
      static_cast<std::int64_t>(static_cast<double>(record.metrics->row_solves) / record.duration));
}

/// Returns advice for scenes where no setting is good: no smaller sub-steps where these let errors grow.
std::string beyond_text(const std::vector<SweepRecord>& records) {
  const auto worst = std::ranges::max_element(
      records, {}, [](const SweepRecord& record) { return record.substep_radius.value_or(0); });
  constexpr double rounding = 1e-6;
  if (!(worst->substep_radius.value_or(0) > 1 + rounding)) return "take smaller steps than were measured";
  return fmt::format(
      "smaller sub-steps are no way there in {}, where what rows that share bodies leave grows by a factor "
      "of {:.3g} in each, however small. Take more iterations or a smaller τ, or smaller steps of A1",
      spoken(*worst, has_joints(records)), *worst->substep_radius);
}

std::string choice_text(const std::vector<SweepRecord>& records) {
  const auto coarse = cheapest(records, 0.01);
  const auto fine = cheapest(records, 0.001);
  const bool turns = turns_in_place(records);
  const char* const one = turns ? "0.01 rad" : "1 % of the scene's size";
  const char* const tenth = turns ? "0.001 rad" : "0.1 %";
  if (!coarse) return fmt::format("No run stays within {}: {}. ", one, beyond_text(records));
  std::string text =
      fmt::format("For {} take **{}** ({}, measured {})", one, spoken(*coarse, has_joints(records)),
                  price_text(*coarse), error_text(*coarse));
  if (!fine) return text + fmt::format("; no run gets to {}. ", tenth);
  if (fine->key == coarse->key) return text + fmt::format("; nothing cheaper gets to {} either. ", tenth);
  return text + fmt::format("; for {} **{}** ({}, measured {}). ", tenth, spoken(*fine, has_joints(records)),
                            price_text(*fine), error_text(*fine));
}

const SweepRecord* most_accurate(const std::vector<SweepRecord>& records) {
  const SweepRecord* best = nullptr;
  for (const SweepRecord& record : records) {
    if (is_own_run(record) && record.metrics->bounded &&
        (!best || error_or_gap_of(record) < error_or_gap_of(*best)))
      best = &record;
  }
  return best;
}

/// Returns the distance of a run's change of energy from that of the most accurate run or, without contacts,
/// from 0 where that is less, relative to the energy that can be lost. Returns 0 where bodies move in contact
/// after the reference has diverged: no run is right there.
double energy_error(const SweepRecord& record, const SweepRecord& best) {
  const Metrics& x = *record.metrics;
  const bool is_known =
      record.contacts != ContactKind::moving || record.horizon > record.duration - record.settings.step / 2;
  if (!(x.energy_scale > 0) || !is_known) return 0;
  const double distance = std::abs(x.energy_change - best.metrics->energy_change);
  const bool can_lose = record.contacts != ContactKind::none;
  return (can_lose ? distance : std::min(distance, std::abs(x.energy_change))) / x.energy_scale;
}

/// Returns true where the run is good enough for cheapest(). `best`: the most accurate run, or null.
bool is_good(const SweepRecord& record, const SweepRecord* best, double tolerance) {
  const Metrics& x = *record.metrics;
  if (!x.bounded || !(error_or_gap_of(record) <= tolerance)) return false;
  const double limit = tolerance * record.size;
  // Allow ten times as much for energy, which is measured over the whole run.
  return x.joint_gap <= limit && x.penetration <= limit && energy_error(record, *best) <= 10 * tolerance;
}

/// Returns the fault of a run that was near the reference as long as it lasted; empty: none.
std::string late_fault(const SweepRecord& record, const SweepRecord* best) {
  const Metrics& x = *record.metrics;
  if (x.diverged) return fmt::format("it diverges at {:.2g} s", *x.diverged);
  if (x.bounded && best && energy_error(record, *best) > 0.1) {
    return fmt::format("its energy changes by {} J, that of the most accurate run by {} J",
                       short_number(x.energy_change), short_number(best->metrics->energy_change));
  }
  if (x.bounded) return "";
  if (x.energy_growth > 0.1 * x.energy_scale)
    return fmt::format("its energy rises by {} J", short_number(x.energy_growth));
  if (x.joint_gap > x.penetration) return fmt::format("joints open by {} m", short_number(x.joint_gap));
  if (record.contacts != ContactKind::standing || x.moved < 5 * x.penetration)
    return fmt::format("bodies overlap by {} m", short_number(x.penetration));
  return fmt::format("a body ends up to {} m from where it should stand", short_number(x.moved));
}

/// Returns a text on settings that look good as long as the reference lasts, and are not.
std::string late_text(const std::vector<SweepRecord>& records) {
  const SweepRecord* const best = most_accurate(records);
  const SweepRecord* cheapest_fault = nullptr;
  int count = 0;
  for (const SweepRecord& record : records) {
    if (!is_own_run(record) || !(error_of(record) <= 0.01) || late_fault(record, best).empty()) continue;
    ++count;
    if (!cheapest_fault || time_or_rows(record) < time_or_rows(*cheapest_fault)) cheapest_fault = &record;
  }
  if (!cheapest_fault) return "";
  const std::string fault = fmt::format("{}, where {}. ", spoken(*cheapest_fault, has_joints(records)),
                                        late_fault(*cheapest_fault, best));
  const std::string span = fmt::format("within 1 % for the first {:.3g} s", cheapest_fault->horizon);
  const std::string end = fmt::format("not right to the end ({:g} s)", cheapest_fault->duration);
  if (count == 1) return fmt::format("One setting that is {} is {}: {}", span, end, fault);
  return fmt::format("{} settings that are {} are {}: the cheapest is {}", count, span, end, fault);
}

/// Returns true where a run with as many sub-steps and iterations or more and no larger step went wrong.
bool fails_when_finer(const SweepRecord& run, const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(records, [&run](const SweepRecord& other) {
    if (!is_own_run(other) || other.metrics->bounded) return false;
    const Settings& fine = other.settings;
    Settings same = run.settings;
    if (fine.algorithm != same.algorithm || fine.step > same.step || fine.substeps < same.substeps ||
        fine.iterations < same.iterations)
      return false;
    same.step = fine.step;
    same.substeps = fine.substeps;
    same.iterations = fine.iterations;
    return label(same) == label(fine);
  });
}

}  // namespace

std::string spoken(const SweepRecord& record, bool joints) {
  const Settings& s = record.settings;
  const Settings usual = default_settings(s.algorithm);
  std::vector<std::string> words;
  if (field_named("substeps").is_read_by(s.algorithm)) words.push_back(fmt::format("n = {}", s.substeps));
  if (s.algorithm >= Algorithm::a2 && (s.algorithm == Algorithm::a2 || s.iterations > 1)) {
    words.push_back(fmt::format("m = {}", s.iterations));
  }
  const bool is_substepping = s.algorithm >= Algorithm::a3 && is_of_report(s.algorithm);
  if (is_substepping && (tau_text(s) != tau_text(usual) || kappa_text(s) != kappa_text(usual))) {
    words.push_back(fmt::format("τ = {}", tau_text(s)));
    words.push_back(fmt::format("κ = {}", kappa_text(s)));
  }
  if (is_substepping && joints && s.joints != usual.joints) {
    words.push_back(s.joints == Joints::rows ? "single rows" : fmt::format("{} joints", name(s.joints)));
  }
  for (const SettingsPart& part : parts_of(s)) {
    const bool is_step = part.field->name == "step";
    // Skip n, m, τ, κ and joints, whose groups are 0 and 1.
    if (!is_step && part.field->label.group < 2) continue;
    std::string word = part.text + (is_step ? " s" : "");
    words.push_back(word.replace(word.find('='), 1, " = "));
  }
  return fmt::format("{} with {}", title_of(s.algorithm), fmt::join(words, ", "));
}

double cpu_time_of(const SweepRecord& record) {
  return record.times ? record.times->median / record.duration : std::numeric_limits<double>::quiet_NaN();
}

bool is_own_run(const SweepRecord& record) {
  return record.engine.empty() && record.metrics.has_value();
}

double time_or_rows(const SweepRecord& record) {
  if (record.times) return cpu_time_of(record);
  // Count one row where a scene has none: its steps are not free.
  return std::max(static_cast<double>(record.metrics->row_solves), 1.0);
}

std::optional<SweepRecord> cheapest(const std::vector<SweepRecord>& records, double tolerance) {
  const SweepRecord* const best = most_accurate(records);
  std::optional<SweepRecord> found;
  for (const SweepRecord& record : records) {
    if (!is_own_run(record) || !is_good(record, best, tolerance)) continue;
    if (found && !(time_or_rows(record) < time_or_rows(*found))) continue;
    if (!fails_when_finer(record, records)) found = record;
  }
  return found;
}

std::vector<SweepRecord> best_runs(const std::vector<SweepRecord>& records) {
  std::vector<SweepRecord> candidates;
  for (const SweepRecord& record : records) {
    if (is_own_run(record) && record.metrics->bounded) candidates.push_back(record);
  }
  std::ranges::stable_sort(candidates, {}, time_or_rows);
  std::vector<SweepRecord> best;
  double error = infinity;
  for (const SweepRecord& record : candidates) {
    // Count errors below 1e-9 as equal.
    const double own = std::max(error_or_gap_of(record), 1e-9);
    if (own < 0.8 * error) {
      best.push_back(record);
      error = own;
    }
  }
  return best;
}

std::string advice(const std::vector<SweepRecord>& records) {
  std::string text = choice_text(records) + late_text(records);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

std::optional<double> measured_order(const std::vector<SweepRecord>& family) {
  std::vector<std::array<double, 2>> points;
  for (const SweepRecord& record : family) {
    const double error = error_of(record);
    if (record.metrics->bounded && error > smallest_plotted_error && exceeds_uncertainty(record)) {
      points.push_back({std::log2(sub_step_of(record.settings)), std::log2(error)});
    }
  }
  std::ranges::sort(points);
  if (points.size() > 4) points.resize(4);
  if (points.size() < 3) return std::nullopt;
  const auto count = static_cast<double>(points.size());
  double x = 0;
  double y = 0;
  for (const auto& point : points) {
    x += point[0] / count;
    y += point[1] / count;
  }
  double above = 0;
  double below = 0;
  for (const auto& point : points) {
    above += (point[0] - x) * (point[1] - y);
    below += (point[0] - x) * (point[0] - x);
  }
  // Return nothing for runs of one step size, which have no order.
  if (below < 1e-9) return std::nullopt;
  return above / below;
}

}  // namespace substep
