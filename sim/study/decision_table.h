#pragma once
/// Which algorithm to take for which kind of scene, and how many sub-steps: rules that are made from some
/// scenes of a sweep and tried on others, which had no part in them.
///
/// A rule names an algorithm, its iterations, τ, κ and joints. The number of sub-steps (of A1 and A2 the part
/// of the scene's step) comes from the scene itself: it is doubled until a run is accepted. A run is accepted
/// that stays bounded, whose joints and contacts are closed to the error wanted, and whose RMS difference to
/// the run with half as many is at most that error over `refinement_margin`; of A4 and A5, whose model no
/// number of sub-steps mends, also that to A3 with the same settings. No reference is needed for that, only
/// that it is known what should stand. Where no run of the sweep is accepted the rule gives no advice.
///
/// Of all settings that ran on scenes of a kind, a rule takes those that are right on most of them: the
/// accepted run is good enough (advice.h) and costs at most ten times the cheapest that is. Among these it
/// takes those that are wrong on fewest, and among these the one whose largest cost is smallest. It promises
/// the error, and twice that cost or ten times the cheapest's, whichever is less. On a scene that was held
/// out a rule is right where the run that it accepts keeps what it promises.
///
/// The sweep's file says which scenes are held out. Where it holds out none, it is, of each kind, its scenes
/// sorted by name, the second, the fifth, the eighth ….

#include <cmath>
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
inline constexpr double refinement_margin = 2;
inline constexpr double rule_margin = 2;  ///< in cost
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
  int right_on = 0;                    ///< of them
  /// The settings as they ran on one of them; nothing where none is right on any.
  std::optional<SweepRecord> setting;
  int least_refinement = 0;  ///< n, or into how many parts A1 and A2 divide the step, on these scenes
  int most_refinement = 0;
  double cost_ratio = 0;  ///< promised: over the cheapest setting that is good enough
  double least_cost = 0;  ///< CPU time of a simulated second, s; not a number where there are no times
  double most_cost = 0;
};

/// A rule on a scene that was held out, where some setting measured is good enough.
struct RuleTrial {
  std::string scene;
  std::size_t rule = 0;               ///< index into DecisionTable::rules
  std::optional<SweepRecord> advice;  ///< the run that is accepted
  std::string fault;                  ///< why it is not right; empty: it is, or there is no advice
  bool keeps_error = false;           ///< it is as accurate as promised, whatever it costs
  double cost_ratio = NAN;  ///< over the cheapest that is good enough; not a number where it is not good
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
