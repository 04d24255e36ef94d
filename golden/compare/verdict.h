#pragma once
/// Verdicts of cases, and the outcome of all of them.

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace substep::golden {

/// The gravest first.
enum class Verdict {
  error,               ///< it could not be checked: a damaged file, a crash, too long
  golden_edited,       ///< a golden is not the one that was approved: its own hash does not hold
  both_changed,        ///< simulation and renderer
  simulation_changed,  ///< the same bodies move otherwise
  loading_changed,     ///< the same file, but other bodies are loaded of it
  scene_changed,       ///< the scene's file holds another scene than the goldens were made of
  renderer_changed,    ///< the same poses are drawn otherwise
  missing,             ///< some of the case's goldens are not there
  created,             ///< none is: the case is new
  environment,         ///< pictures beyond the tolerance, on another renderer than theirs
  pass,
};

/// The names of all verdicts, in their order.
inline constexpr std::array<std::string_view, 11> verdict_names{"error",
                                                                "golden edited",
                                                                "both changed",
                                                                "simulation changed",
                                                                "loading changed",
                                                                "scene changed",
                                                                "renderer changed",
                                                                "missing",
                                                                "new",
                                                                "environment",
                                                                "pass"};

inline std::string_view name(Verdict verdict) {
  return verdict_names[static_cast<std::size_t>(verdict)];
}

/// Returns the verdict of a name; error where there is none.
Verdict verdict_named(std::string_view name);

/// Returns 0: all pass. 1: something differs, is new, missing, an orphan or an error. 3: nothing but the
/// environment.
int exit_code(std::span<const Verdict> cases, std::size_t orphans);

/// Returns one line, without what there is none of: "3 simulation changed, 1 orphan, 30 pass".
std::string totals(std::span<const Verdict> cases, std::size_t orphans);

}  // namespace substep::golden
