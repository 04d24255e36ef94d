#include "sim/study/sweep_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "sim/measure/text_table.h"
#include "sim/model/settings_fields.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

/// Returns the largest step of the records, which is the scene's.
double scene_step(const std::vector<SweepRecord>& records) {
  double step = 0;
  for (const SweepRecord& record : records) step = std::max(step, record.settings.step);
  return step;
}

/// Returns true where equal_row_runs() has a run with these settings.
bool is_at_equal_rows(const Settings& s, double step) {
  const bool is_a2 = s.algorithm == Algorithm::a2;
  const Settings plain{.algorithm = s.algorithm,
                       .step = step,
                       .substeps = s.substeps,
                       .iterations = is_a2 ? s.iterations : 1,
                       .joints = Joints::rows};
  return (is_a2 || s.algorithm == Algorithm::a3) && label(s) == label(plain);
}

/// The lines of a scene's figure: along each, only one setting of its runs varies.
class Lines {
 public:
  explicit Lines(const std::vector<SweepRecord>& records)
      : step_(scene_step(records)), contacts_(has_contacts(records)) {
    for (const SweepRecord& record : records) {
      if (!record.metrics) continue;
      const Settings& s = record.settings;
      if (!record.engine.empty()) {
        iterations_of_engines_[record.engine].insert(s.iterations);
        continue;
      }
      Values& own = values_[s.algorithm];
      own.steps_of[s.iterations].insert(s.step);
      if (s.joints != Joints::rows) own.substeps.insert(s.substeps);
    }
  }

  std::string title_of(const SweepRecord& record) const {
    if (!record.engine.empty()) {
      const Engine* const engine = find_engine(record.engine);
      std::string title = engine ? engine->label : record.engine;
      const int m = record.settings.iterations;
      return iterations_of_engines_.at(record.engine).size() > 1 ? fmt::format("{} m={}", title, m) : title;
    }
    const Settings& s = record.settings;
    std::string title(substep::title_of(s.algorithm));
    if (s.algorithm == Algorithm::a2)
      title += is_by_iterations() ? ", by m" : fmt::format(" m={}", s.iterations);
    if (s.algorithm >= Algorithm::a3 && is_of_report(s.algorithm)) {
      if (s.iterations > 1) title += fmt::format(" m={}", s.iterations);
      title += fmt::format(" {}", name(s.joints));
      if (tau_text(s) != "1") title += fmt::format(" τ={}", tau_text(s));
      if (kappa_text(s) != "1") title += fmt::format(" κ={}", kappa_text(s));
    }
    for (const SettingsField& field : settings_fields) {
      if (field.can_be_left_out && !field.is_left_out(s))
        title += fmt::format(" {}{}", field.label.symbol, text_of(s, field));
    }
    return title;
  }

  /// Returns the reason why the run is on no line; empty where it is on one.
  std::string reason_against(const SweepRecord& record) const {
    const Settings& s = record.settings;
    if (!record.engine.empty() || s.algorithm == Algorithm::a1) return "";
    const bool is_at_step = s.step == step_;
    if (!is_of_report(s.algorithm)) return is_at_step ? "" : "another step than the scene's";
    const Values& own = values_.at(s.algorithm);
    if (s.algorithm == Algorithm::a2) {
      if (is_by_iterations()) return is_at_step ? "" : "another step than the scene's";
      return own.steps_of.at(s.iterations).size() > 1 || own.steps_of.size() == 1
                 ? ""
                 : "this m at one step alone";
    }
    if (s.joints == Joints::rows)
      return is_at_equal_rows(s, step_) ? "single rows, which 'equal-rows' shows" : "single rows";
    if (s.iterations != own.steps_of.begin()->first) return "a line follows n, with the fewest iterations m";
    return is_at_step || own.substeps.size() == 1 ? "" : "another step than the scene's";
  }

 private:
  struct Values {
    std::set<int> substeps;
    std::map<int, std::set<double>> steps_of;  ///< by the number of iterations
  };

  /// True where the line of A2 follows m at the scene's step, instead of the step at each m.
  bool is_by_iterations() const {
    const auto found = values_.find(Algorithm::a2);
    if (found == values_.end()) return false;
    const auto is_at_step = [&](const auto& steps) { return steps.second.contains(step_); };
    const auto has_several = [](const auto& steps) { return steps.second.size() > 1; };
    const auto& steps_of = found->second.steps_of;
    return std::ranges::count_if(steps_of, is_at_step) > 1 &&
           (contacts_ || std::ranges::none_of(steps_of, has_several));
  }

  double step_;
  bool contacts_;
  std::map<Algorithm, Values> values_;
  std::map<std::string, std::set<int>> iterations_of_engines_;
};

/// Returns true unless the refinements of the reference diverge at once.
bool has_reference(const SweepRecord& record) {
  return record.horizon > 0 || record.divergence_point.empty();
}

std::string name_of(const SweepRecord& record) {
  return record.engine.empty() ? std::string(title_of(record.settings.algorithm)) : record.engine;
}

/// Removes families of one run where the algorithm or engine has a line, and returns them.
std::vector<RunFamily> take_single_runs(std::vector<RunFamily>& families) {
  std::set<std::string> with_lines;
  for (const RunFamily& family : families) {
    if (family.runs.size() > 1) with_lines.insert(name_of(family.runs.front()));
  }
  const auto is_line = [&](const RunFamily& family) {
    return family.runs.size() > 1 || !with_lines.contains(name_of(family.runs.front()));
  };
  const auto first = std::stable_partition(families.begin(), families.end(), is_line);
  std::vector<RunFamily> single(first, families.end());
  families.erase(first, families.end());
  return single;
}

std::vector<RunFamily> all_families(const std::vector<SweepRecord>& records) {
  const Lines lines(records);
  std::vector<RunFamily> families;
  for (const SweepRecord& record : records) {
    if (!record.metrics || !lines.reason_against(record).empty()) continue;
    const std::string title = lines.title_of(record);
    const auto found = std::ranges::find(families, title, &RunFamily::title);
    RunFamily& family = found == families.end() ? families.emplace_back(RunFamily{title, {}}) : *found;
    family.runs.push_back(record);
  }
  return families;
}

/// Returns true where centres err by less than a millionth of the turn: the bodies turn about their centres.
bool is_turn_alone(const SweepRecord& record) {
  if (!record.metrics) return false;
  const MotionDifference& error = record.metrics->error;
  return record.turns_in_place || error.position.rms < 1e-6 * record.size * error.orientation.rms;
}

}  // namespace

std::string percent(double fraction) {
  if (!std::isfinite(fraction)) return "lost";
  if (std::abs(fraction) < 1e-11) return "rounding";
  return std::abs(fraction) < 0.995 ? fmt::format("{:.2g} %", 100 * fraction)
                                    : fmt::format("{:.0f} %", 100 * fraction);
}

std::string error_text(const SweepRecord& record) {
  const double error = error_or_gap_of(record);
  if (!has_reference(record) || !is_turn_alone(record) || !(error >= 1e-11) || !std::isfinite(error))
    return percent(error);
  return fmt::format("{} rad", short_number(error));
}

bool turns_in_place(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(records, [](const SweepRecord& record) {
    return is_turn_alone(record) && error_of(record) > smallest_plotted_error;
  });
}

void mark_turns(std::vector<SweepRecord>& records) {
  std::set<std::string> scenes;
  for (const SweepRecord& record : records) {
    if (is_own_run(record) && turns_in_place({record})) scenes.insert(record.scene);
  }
  for (SweepRecord& record : records) record.turns_in_place = scenes.contains(record.scene);
}

bool has_contacts(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(
      records, [](const SweepRecord& record) { return record.metrics && record.metrics->penetration > 0; });
}

bool has_joints(const std::vector<SweepRecord>& records) {
  return std::ranges::any_of(
      records, [](const SweepRecord& record) { return record.metrics && record.metrics->joint_gap > 0; });
}

std::vector<RunFamily> families_of(const std::vector<SweepRecord>& records) {
  std::vector<RunFamily> families = all_families(records);
  take_single_runs(families);
  std::ranges::stable_sort(families, {}, [](const RunFamily& family) {
    const SweepRecord& first = family.runs.front();
    return first.engine.empty() ? static_cast<int>(first.settings.algorithm) : 7;
  });
  return families;
}

std::vector<RunsLeftOut> left_out_of(const std::vector<SweepRecord>& records) {
  const Lines lines(records);
  std::vector<RunsLeftOut> result;
  const auto add = [&result](RunsLeftOut runs) {
    const auto found = std::ranges::find_if(result, [&](const RunsLeftOut& other) {
      return other.title == runs.title && other.reason == runs.reason;
    });
    if (found == result.end()) {
      result.push_back(std::move(runs));
    } else {
      ++found->count;
    }
  };
  for (const SweepRecord& record : records) {
    if (!record.metrics) continue;
    std::string reason = lines.reason_against(record);
    if (!reason.empty()) add({lines.title_of(record), std::move(reason), 1});
  }
  std::vector<RunFamily> families = all_families(records);
  for (const RunFamily& family : take_single_runs(families))
    add({name_of(family.runs.front()), "single runs beside its lines", 1});
  return result;
}

std::vector<EqualRowRun> equal_row_runs(const std::vector<SweepRecord>& records, const std::string& scene) {
  const std::vector<SweepRecord> own = of_scene(records, scene);
  const double step = scene_step(own);
  std::vector<EqualRowRun> runs;
  std::array<double, 2> rows{};  // of one sweep, of A2 and of A3; runs that diverge have fewer
  for (const SweepRecord& record : own) {
    const Settings& s = record.settings;
    if (!is_own_run(record) || !is_at_equal_rows(s, step)) continue;
    const bool is_a2 = s.algorithm == Algorithm::a2;
    const int n = is_a2 ? s.iterations : s.substeps;
    double& most = rows.at(is_a2 ? 0 : 1);
    most = std::max(most, static_cast<double>(record.metrics->row_solves) / n);
    runs.push_back({n, record});
  }
  // Count the equal parts in which A2 takes the step where joints are taut.
  const int parts = rows[1] > 0 ? std::max(1, static_cast<int>(std::lround(rows[0] / rows[1]))) : 1;
  for (EqualRowRun& run : runs) {
    if (run.record.settings.algorithm == Algorithm::a2) run.n *= parts;
  }
  return runs;
}

std::vector<SweepRecord> of_scene(const std::vector<SweepRecord>& records, const std::string& scene) {
  std::vector<SweepRecord> own;
  for (const SweepRecord& record : records) {
    if (record.scene == scene) own.push_back(record);
  }
  return own;
}

std::vector<std::string> scenes_of(const std::vector<SweepRecord>& records) {
  std::vector<std::string> names;
  for (const SweepRecord& record : records) {
    if (std::ranges::find(names, record.scene) == names.end()) names.push_back(record.scene);
  }
  return names;
}

bool exceeds_uncertainty(const SweepRecord& record) {
  const double error = error_of(record);
  if (!std::isfinite(error)) return true;
  const double uncertainty =
      is_turn_alone(record) ? record.turn_uncertainty : record.uncertainty / record.size;
  return error < smallest_plotted_error || error >= 100 * uncertainty;
}

double error_or_gap_of(const SweepRecord& record) {
  if (has_reference(record) || !record.metrics) return error_of(record);
  if (record.metrics->diverged) return infinity;
  return std::max(record.metrics->joint_gap, record.metrics->penetration) / record.size;
}

std::string error_or_gap_title(const std::vector<SweepRecord>& records) {
  if (!has_reference(records.front())) return "gap or overlap / size";
  return turns_in_place(records) ? "RMS turn, rad" : "RMS error / size";
}

bool is_other_engine(const SweepRecord& record) {
  const Engine* const engine = find_engine(record.engine);
  return !record.engine.empty() && !(engine && engine->is_ours);
}

double substep_of(const SweepRecord& record) {
  const Engine* const engine = find_engine(record.engine);
  return sub_step_of(record.settings) /
         (engine && engine->iterations_are_substeps ? record.settings.iterations : 1);
}

double error_of(const SweepRecord& record) {
  if (!record.metrics) return infinity;
  const MotionDifference& error = record.metrics->error;
  return is_turn_alone(record) ? error.orientation.rms : error.position.rms / record.size;
}

}  // namespace substep
