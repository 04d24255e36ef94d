#include "sim/study/decision_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "sim/model/settings_fields.h"
#include "sim/study/advice.h"
#include "sim/study/sweep_results.h"

namespace substep {
namespace {

constexpr std::array accuracies{0.01, 0.001};
constexpr double infinite = std::numeric_limits<double>::infinity();

using Records = std::vector<SweepRecord>;

struct KindOfScenes {
  std::vector<Records> made_from;
  std::vector<Records> held_out;
};

/// Loops and springs of too few scenes join the others without contacts.
void join_small_kinds(std::map<SceneKind, KindOfScenes>& kinds) {
  for (auto it = kinds.begin(); it != kinds.end();) {
    SceneKind wider = it->first;
    wider.has_loops = wider.has_springs = false;
    if (wider == it->first || it->second.made_from.size() >= scenes_of_a_line) {
      ++it;
      continue;
    }
    const KindOfScenes small = std::move(it->second);
    it = kinds.erase(it);
    KindOfScenes& joined = kinds[wider];
    joined.made_from.insert(joined.made_from.end(), small.made_from.begin(), small.made_from.end());
    joined.held_out.insert(joined.held_out.end(), small.held_out.begin(), small.held_out.end());
  }
}

bool is_held_out(const SweepRecord& record) {
  return record.use == SceneUse::trial;
}

/// With the scenes held out that the sweep's file names.
std::map<SceneKind, KindOfScenes> kinds_as_named(const Records& records) {
  std::map<SceneKind, KindOfScenes> kinds;
  for (const std::string& scene : scenes_of(records)) {
    const Records own = of_scene(records, scene);
    if (std::ranges::none_of(own, is_own_run)) continue;
    KindOfScenes& kind = kinds[kind_of(own.front().traits)];
    (is_held_out(own.front()) ? kind.held_out : kind.made_from).push_back(own);
  }
  join_small_kinds(kinds);
  return kinds;
}

/// With a third of each kind's scenes held out: the first, second or last of each three by name.
std::map<SceneKind, KindOfScenes> kinds_by_thirds(const Records& records, std::size_t third) {
  std::map<SceneKind, std::vector<std::string>> names;
  for (const std::string& scene : scenes_of(records)) {
    const Records own = of_scene(records, scene);
    if (std::ranges::any_of(own, is_own_run)) names[kind_of(own.front().traits)].push_back(scene);
  }
  std::map<SceneKind, KindOfScenes> kinds;
  for (auto& [kind, scenes] : names) {
    std::ranges::sort(scenes);
    for (std::size_t i = 0; i < scenes.size(); ++i)
      (i % 3 == third ? kinds[kind].held_out : kinds[kind].made_from).push_back(of_scene(records, scenes[i]));
  }
  join_small_kinds(kinds);
  return kinds;
}

/// n, or into how many parts A1 and A2 divide the scene's step.
int refinement_of(const SweepRecord& run) {
  return run.settings.algorithm >= Algorithm::a3 ? run.settings.substeps : run.divisions;
}

/// Whether the two differ in nothing but that. Joints are no setting of a scene without any.
bool is_of_family(const SweepRecord& run, const SweepRecord& setting) {
  if (!is_own_run(run) || (run.settings.algorithm >= Algorithm::a3 && run.divisions != 1)) return false;
  return std::ranges::all_of(settings_fields, [&](const SettingsField& field) {
    const bool is_asked =
        field.name != "step" && field.name != "substeps" && (field.name != "joints" || run.traits.has_joints);
    return !is_asked || text_of(run.settings, field) == text_of(setting.settings, field);
  });
}

/// To the run with half as many sub-steps; infinite where there is none.
double difference_of(const SweepRecord& run) {
  return run.coarser ? relative_difference(*run.coarser, run.size) : infinite;
}

bool is_accepted(const SweepRecord& run, double accuracy) {
  const Metrics& x = *run.metrics;
  const double most = accuracy * run.size;
  return x.bounded && std::max(x.joint_gap, x.penetration) <= most &&
         difference_of(run) <= accuracy / refinement_margin &&
         x.parts.model.value_or(0) <= most / refinement_margin;
}

/// The scene's runs with the setting, the coarsest first.
std::vector<const SweepRecord*> family_of(const Records& scene, const SweepRecord& setting) {
  std::vector<const SweepRecord*> family;
  for (const SweepRecord& run : scene) {
    if (is_of_family(run, setting)) family.push_back(&run);
  }
  std::ranges::sort(family, {}, [](const SweepRecord* run) { return refinement_of(*run); });
  return family;
}

/// The coarsest that is accepted, or none.
const SweepRecord* accepted(const std::vector<const SweepRecord*>& family, double accuracy) {
  const auto found =
      std::ranges::find_if(family, [&](const SweepRecord* run) { return is_accepted(*run, accuracy); });
  return found == family.end() ? nullptr : *found;
}

/// Cost over the cheapest good setting's; infinite where there is none.
double cost_ratio(const Records& scene, const SweepRecord& record, double accuracy) {
  const auto best = cheapest(scene, accuracy);
  return best ? time_or_rows(record) / time_or_rows(*best) : infinite;
}

/// What a setting is worth on the scenes that a rule is made from.
struct Worth {
  int right_on = 0;
  int wrong_on = 0;
  double cost = 0;  ///< the largest ratio where it is right

  bool operator<(const Worth& other) const {
    return std::tuple(-right_on, wrong_on, cost) < std::tuple(-other.right_on, other.wrong_on, other.cost);
  }
};

Worth worth_of(const SweepRecord& setting, const std::vector<Records>& scenes, double accuracy) {
  Worth worth;
  for (const Records& scene : scenes) {
    const SweepRecord* const run = accepted(family_of(scene, setting), accuracy);
    if (!run) continue;
    const double ratio = cost_ratio(scene, *run, accuracy);
    if (ratio > rule_cost || !fault_of(*run, scene, accuracy).empty()) {
      ++worth.wrong_on;
      continue;
    }
    ++worth.right_on;
    worth.cost = std::max(worth.cost, ratio);
  }
  return worth;
}

/// One run of each setting that any of the scenes ran with.
std::vector<const SweepRecord*> settings_of(const std::vector<Records>& scenes) {
  std::vector<const SweepRecord*> settings;
  for (const Records& scene : scenes) {
    for (const SweepRecord& run : scene) {
      const bool is_new = is_own_run(run) && std::ranges::none_of(settings, [&](const SweepRecord* setting) {
                            return is_of_family(run, *setting);
                          });
      if (is_new) settings.push_back(&run);
    }
  }
  return settings;
}

void add_figures(const std::vector<Records>& scenes, Rule& rule) {
  rule.least_cost = infinite;
  rule.least_refinement = std::numeric_limits<int>::max();
  for (const Records& scene : scenes) {
    const SweepRecord* const run = accepted(family_of(scene, *rule.setting), rule.accuracy);
    if (!run) continue;
    rule.least_cost = std::min(rule.least_cost, cost_of(*run));
    rule.most_cost = std::max(rule.most_cost, cost_of(*run));
    rule.least_refinement = std::min(rule.least_refinement, refinement_of(*run));
    rule.most_refinement = std::max(rule.most_refinement, refinement_of(*run));
  }
}

Rule rule_for(const SceneKind& kind, const std::vector<Records>& all, double accuracy) {
  Rule rule;
  rule.kind = kind;
  rule.accuracy = accuracy;
  std::vector<Records> scenes;
  for (const Records& scene : all) {
    // Where nothing is good enough there is nothing to learn.
    if (!cheapest(scene, accuracy)) continue;
    scenes.push_back(scene);
    rule.made_from.push_back(scene.front().scene);
  }
  if (scenes.empty()) return rule;
  std::optional<Worth> best;
  for (const SweepRecord* const setting : settings_of(scenes)) {
    const Worth worth = worth_of(*setting, scenes, accuracy);
    if (worth.right_on == 0 || (best && !(worth < *best))) continue;
    best = worth;
    rule.setting = *setting;
  }
  if (!best) return rule;
  rule.right_on = best->right_on;
  rule.cost_ratio = std::min(rule_margin * best->cost, rule_cost);
  add_figures(scenes, rule);
  return rule;
}

RuleTrial trial_of(const Rule& rule, std::size_t index, const Records& scene) {
  RuleTrial trial;
  trial.scene = scene.front().scene;
  trial.rule = index;
  const SweepRecord* const run =
      rule.setting ? accepted(family_of(scene, *rule.setting), rule.accuracy) : nullptr;
  if (!run) return trial;
  trial.advice = *run;
  trial.fault = fault_of(*run, scene, rule.accuracy);
  if (!trial.fault.empty()) return trial;
  trial.keeps_error = true;
  trial.cost_ratio = cost_ratio(scene, *run, rule.accuracy);
  if (trial.cost_ratio > rule.cost_ratio) {
    trial.fault = fmt::format("{:.2g} times the cost of {}, at most {:.2g} are promised", trial.cost_ratio,
                              cheapest(scene, rule.accuracy)->label, rule.cost_ratio);
  }
  return trial;
}

DecisionTable made_of(const std::map<SceneKind, KindOfScenes>& kinds) {
  DecisionTable table;
  for (const auto& [kind, scenes] : kinds) {
    for (const double accuracy : accuracies) {
      table.rules.push_back(rule_for(kind, scenes.made_from, accuracy));
      for (const Records& scene : scenes.held_out) {
        if (!cheapest(scene, accuracy)) continue;
        table.trials.push_back(trial_of(table.rules.back(), table.rules.size() - 1, scene));
      }
    }
  }
  return table;
}

/// Scenes of trials, each once: those of which all trials that count are `wanted`.
template <typename Wanted>
std::vector<std::string> scenes_where(const std::vector<RuleTrial>& trials, const Wanted& wanted) {
  std::vector<std::string> scenes;
  for (const RuleTrial& trial : trials) {
    if (!trial.advice || std::ranges::find(scenes, trial.scene) != scenes.end()) continue;
    const bool all = std::ranges::all_of(trials, [&](const RuleTrial& other) {
      return other.scene != trial.scene || !other.advice || wanted(other);
    });
    if (all) scenes.push_back(trial.scene);
  }
  return scenes;
}

}  // namespace

SceneKind kind_of(const SceneTraits& traits) {
  const bool has_contacts = traits.contacts != ContactKind::none;
  return {traits.contacts, !has_contacts && traits.has_loops, !has_contacts && traits.spring_angle > 1,
          traits.mass_ratio >= heavy_ratio};
}

std::string title_of(const SceneKind& kind) {
  std::string text;
  switch (kind.contacts) {
    case ContactKind::none:
      text = kind.has_loops ? "no contacts, closed loops" : "no contacts";
      break;
    case ContactKind::standing:
      text = "contacts that stand";
      break;
    case ContactKind::rolling:
      text = "contacts, round bodies";
      break;
    case ContactKind::moving:
      text = "contacts that slide or fall";
      break;
  }
  if (kind.has_springs) text += ", stiff springs";
  if (kind.is_heavy) text += fmt::format(", mass ratio from {:g}", heavy_ratio);
  return text;
}

std::vector<std::string> DecisionTable::tried() const {
  return scenes_where(trials, [](const RuleTrial&) { return true; });
}

std::vector<std::string> DecisionTable::right() const {
  return scenes_where(trials, [](const RuleTrial& trial) { return trial.fault.empty(); });
}

DecisionTable decision_table(const Records& records) {
  return made_of(std::ranges::any_of(records, is_held_out) ? kinds_as_named(records)
                                                           : kinds_by_thirds(records, 1));
}

std::vector<AnswerCount> cross_validation(const Records& all) {
  Records records = all;
  std::erase_if(records, is_held_out);
  std::vector<AnswerCount> counts;
  counts.reserve(accuracies.size());
  for (const double accuracy : accuracies) counts.push_back({accuracy, 0, 0, 0});
  for (std::size_t third = 0; third < 3; ++third) {
    const DecisionTable table = made_of(kinds_by_thirds(records, third));
    for (const RuleTrial& trial : table.trials) {
      if (!trial.advice) continue;
      AnswerCount& count =
          *std::ranges::find(counts, table.rules[trial.rule].accuracy, &AnswerCount::accuracy);
      ++count.answers;
      if (trial.fault.empty()) ++count.right;
      if (trial.keeps_error) ++count.keep_error;
    }
  }
  return counts;
}

}  // namespace substep
