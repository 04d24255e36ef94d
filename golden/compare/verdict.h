#pragma once
/// Verdicts of cases, and the outcome of all of them.

#include <fmt/format.h>

#include <algorithm>
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
inline Verdict verdict_named(std::string_view name) {
  const auto found = std::ranges::find(verdict_names, name);
  return found == verdict_names.end() ? Verdict::error : static_cast<Verdict>(found - verdict_names.begin());
}

/// Returns 0: all pass. 1: something differs, is new, missing, an orphan or an error. 3: nothing but the
/// environment.
inline int exit_code(std::span<const Verdict> cases, std::size_t orphans) {
  const Verdict gravest = cases.empty() ? Verdict::pass : std::ranges::min(cases);
  if (orphans > 0 || gravest < Verdict::environment) return 1;
  return gravest == Verdict::environment ? 3 : 0;
}

/// Returns one line, without what there is none of: "3 simulation changed, 1 orphan, 30 pass".
inline std::string totals(std::span<const Verdict> cases, std::size_t orphans) {
  std::string text;
  for (const std::string_view name : verdict_names) {
    if (name == "pass" && orphans > 0) text += fmt::format("{} orphan, ", orphans);
    const auto count = std::ranges::count(cases, verdict_named(name));
    if (count > 0 || name == "pass") text += fmt::format("{} {}{}", count, name, name == "pass" ? "" : ", ");
  }
  return text;
}

}  // namespace substep::golden
