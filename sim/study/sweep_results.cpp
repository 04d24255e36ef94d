#include "sim/study/sweep_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/model/settings_fields.h"
#include "sim/study/engines/engines.h"

namespace substep {
namespace {

std::string title_of(const SweepRecord& record, bool contacts) {
  if (!record.engine.empty()) {
    for (const Engine& engine : engines()) {
      if (engine.name == record.engine) return engine.label;
    }
    return record.engine;
  }
  const Settings& s = record.settings;
  std::string title(title_of(s.algorithm));
  if (s.algorithm == Algorithm::a2) title += contacts ? ", by m" : fmt::format(" m={}", s.iterations);
  if (s.algorithm >= Algorithm::a3 && is_of_report(s.algorithm)) {
    title += fmt::format(" {}", name(s.joints));
    if (tau_text(s) != "1") title += fmt::format(" τ={}", tau_text(s));
    if (kappa_text(s) != "1") title += fmt::format(" κ={}", kappa_text(s));
  }
  for (const SettingsField& field : settings_fields) {
    if (field.can_be_left_out && !field.is_left_out(s))
      title += fmt::format(" {}{}", field.symbol, text_of(s, field));
  }
  return title;
}

/// Returns true where the run is on a line along which one setting alone varies.
bool is_followed(const SweepRecord& record, double step, bool contacts) {
  if (!record.metrics) return false;
  const Settings& s = record.settings;
  if (!record.engine.empty() || s.algorithm == Algorithm::a1) return true;
  if (!is_of_report(s.algorithm)) return s.step == step;
  if (s.algorithm == Algorithm::a2 && contacts) return s.step == step;
  if (s.algorithm == Algorithm::a2) return s.iterations == 4 || s.iterations == 16;
  return s.iterations == 1 && s.joints != Joints::rows && s.step == step;
}

}  // namespace

std::string percent(double share) {
  if (!std::isfinite(share)) return "lost";
  if (std::abs(share) < 1e-11) return "rounding";
  return std::abs(share) < 0.995 ? fmt::format("{:.2g} %", 100 * share)
                                 : fmt::format("{:.0f} %", 100 * share);
}

double scene_step(const std::vector<SweepRecord>& records) {
  double step = 0;
  for (const SweepRecord& record : records) step = std::max(step, record.settings.step);
  return step;
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
  const double step = scene_step(records);
  const bool contacts = has_contacts(records);
  std::vector<RunFamily> families;
  for (const SweepRecord& record : records) {
    if (!is_followed(record, step, contacts)) continue;
    const std::string title = title_of(record, contacts);
    const auto found = std::ranges::find(families, title, &RunFamily::title);
    RunFamily& family = found == families.end() ? families.emplace_back(RunFamily{title, {}}) : *found;
    family.runs.push_back(record);
  }
  // A run alone is no line.
  std::erase_if(families, [](const RunFamily& family) { return family.runs.size() < 2; });
  std::ranges::stable_sort(families, {}, [](const RunFamily& family) {
    const SweepRecord& first = family.runs.front();
    return first.engine.empty() ? static_cast<int>(first.settings.algorithm) : 7;
  });
  return families;
}

std::vector<SweepRecord> equal_row_runs(const std::vector<SweepRecord>& records, const std::string& scene) {
  const std::vector<SweepRecord> own = of_scene(records, scene);
  const double step = scene_step(own);
  std::vector<SweepRecord> runs;
  for (const SweepRecord& record : own) {
    const Settings& s = record.settings;
    if (!record.metrics || !record.engine.empty() || s.step != step || s.tau != 1 || s.kappa != 1) continue;
    const bool is_a3 = s.algorithm == Algorithm::a3 && s.joints == Joints::rows && s.iterations == 1;
    if (is_a3 || s.algorithm == Algorithm::a2) runs.push_back(record);
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

bool turns_in_place(const std::vector<SweepRecord>& records) {
  return std::ranges::all_of(records, [](const SweepRecord& record) {
    return !record.metrics || !(record.metrics->error.position.rms > 0);
  });
}

bool is_sure(const SweepRecord& record) {
  const double error = error_of(record);
  if (!std::isfinite(error)) return true;
  const bool turns = !(record.metrics->error.position.rms > 0);
  const double uncertainty = turns ? record.turn_uncertainty : record.uncertainty / record.size;
  return error < smallest_plotted_error || error >= 100 * uncertainty;
}

bool is_other_engine(const SweepRecord& record) {
  const auto found = std::ranges::find(engines(), record.engine, &Engine::name);
  return !record.engine.empty() && (found == engines().end() || !found->is_ours);
}

double error_of(const SweepRecord& record) {
  if (!record.metrics) return std::numeric_limits<double>::infinity();
  const MotionDifference& error = record.metrics->error;
  return error.position.rms > 0 ? error.position.rms / record.size : error.orientation.rms;
}

}  // namespace substep
