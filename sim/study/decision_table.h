#pragma once
/// Which setting to take for which kind of scene: rules that are made from some scenes of a sweep and tried
/// on the others, which had no part in them.
///
/// The sweep's file says which scenes are held out. Where it holds out none, it is, of each kind, its scenes
/// sorted by name, the second, the fifth, the eighth …. Of the settings that ran on every other scene of the
/// kind, a rule takes one that is good enough on all of them, with a margin of two in the error where any is;
/// and among those the one whose largest cost, over the cheapest setting's on that scene that is good enough,
/// is smallest. It promises that error, without the margin, and twice that cost, or ten times the cheapest's,
/// whichever is less. Where no setting is good enough on all, there is no rule. On a scene that was held out
/// a rule is right where its setting keeps what it promises.

#include <compare>
#include <optional>
#include <string>
#include <vector>

#include "sim/study/sweep.h"

namespace substep {

/// What a rule is for.
struct SceneKind {
  ContactKind contacts = ContactKind::none;
  bool has_loops = false;    ///< asked where there are no contacts
  bool has_springs = false;  ///< that get further than 1 rad in a step; asked where there are no contacts
  bool is_heavy = false;     ///< masses differ by a factor of at least `heavy_ratio`

  // clang-tidy 14 takes the comparison with 0 that this makes for a pointer's.
  auto operator<=>(const SceneKind&) const = default;  // NOLINT(modernize-use-nullptr)
};

inline constexpr double heavy_ratio = 100;
inline constexpr double rule_margin = 2;  ///< in error and in cost
inline constexpr double rule_cost = 10;   ///< times the cheapest: no rule promises to cost more
/// Loops or springs with fewer scenes to learn from than this have no line of their own: one scene says
/// nothing of the next. (Large mass ratios always have one: what is good on light scenes is not on them.)
inline constexpr std::size_t scenes_of_a_line = 2;

SceneKind kind_of(const SceneTraits& traits);
/// "standing contacts, mass ratio from 100"
std::string title_of(const SceneKind& kind);

struct Rule {
  SceneKind kind;
  double accuracy = 0;                 ///< of the scene's size
  std::vector<std::string> made_from;  ///< scenes
  int good_on = 0;                     ///< of them: so many by the setting that is good enough on most
  /// The setting as it ran on one of them; nothing where no setting is good enough on all.
  std::optional<SweepRecord> setting;
  double cost_ratio = 0;  ///< promised: over the cheapest setting that is good enough
  double least_cost = 0;  ///< CPU time of a simulated second, s; not a number where there are no times
  double most_cost = 0;   ///< over the scenes that it is made from
};

/// A rule on a scene that was held out, where some setting measured is good enough.
struct RuleTrial {
  std::string scene;
  std::size_t rule = 0;      ///< index into DecisionTable::rules
  bool has_advice = true;    ///< the rule has a setting, and the scene ran with it
  std::string fault;         ///< why it is not right; empty: it is
  bool keeps_error = false;  ///< it is as accurate as promised, whatever it costs
  double cost_ratio = 0;     ///< over the cheapest that is good enough; not a number where it is not good
};

struct DecisionTable {
  std::vector<Rule> rules;        ///< by kind, then by accuracy, the mildest first
  std::vector<RuleTrial> trials;  ///< of scenes of a kind that has rules

  /// Scenes that were held out and got advice; and of these those where all of it is right.
  std::vector<std::string> tried() const;
  std::vector<std::string> right() const;
};

/// Of the sweep's scenes with runs of ours.
DecisionTable decision_table(const std::vector<SweepRecord>& records);

/// How many answers of rules were right at an accuracy.
struct AnswerCount {
  double accuracy = 0;
  int answers = 0;
  int right = 0;       ///< in error and in cost
  int keep_error = 0;  ///< in error, whatever they cost
};

/// Of the scenes that the sweep's file does not hold out, each third held out in its turn, with rules made
/// from the other two: one count for each accuracy, the mildest first. So every scene is held out once, and
/// none was chosen for it.
std::vector<AnswerCount> cross_validation(const std::vector<SweepRecord>& records);

}  // namespace substep
