#pragma once
/// What a check says of a case, and what it says of all of them.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace substep::golden {

enum class Verdict {
  pass,
  error,               ///< it could not be checked: a damaged file, a crash, too long
  golden_edited,       ///< a golden is not the one that was approved: its own hash does not hold
  scene_changed,       ///< the scene's file holds another scene than the goldens were made of
  loading_changed,     ///< the same file, but other bodies are loaded of it
  simulation_changed,  ///< the same bodies move otherwise
  renderer_changed,    ///< the same poses are drawn otherwise
  both_changed,        ///< simulation and renderer
  environment,         ///< pictures beyond the tolerance, on another renderer than theirs
  missing,             ///< some of the case's goldens are not there
  created,             ///< none is: the case is new
};

/// The gravest first, what passes last.
inline constexpr std::array<Verdict, 11> verdicts{Verdict::error,
                                                  Verdict::golden_edited,
                                                  Verdict::both_changed,
                                                  Verdict::simulation_changed,
                                                  Verdict::loading_changed,
                                                  Verdict::scene_changed,
                                                  Verdict::renderer_changed,
                                                  Verdict::missing,
                                                  Verdict::created,
                                                  Verdict::environment,
                                                  Verdict::pass};

/// "pass", "simulation changed", …, "new".
std::string_view name(Verdict verdict);
std::optional<Verdict> verdict_named(std::string_view name);

/// 0: all pass. 1: something differs, is new, missing, an orphan or an error. 3: nothing but the environment.
int exit_code(std::span<const Verdict> cases, std::size_t orphans);

/// "3 simulation changed, 1 orphan, 30 pass": one line, without what there is none of.
std::string totals(std::span<const Verdict> cases, std::size_t orphans);

}  // namespace substep::golden
