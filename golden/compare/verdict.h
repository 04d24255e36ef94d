#pragma once
/// Verdicts of cases, and the exit code of a check.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>

namespace substep::golden {

/// The verdict of a case, the gravest first.
enum class Verdict {
  error,               ///< not checked: a damaged file, a crash, a time limit
  golden_edited,       ///< a golden's hash differs from the approved one
  both_changed,        ///< simulation and renderer changed
  simulation_changed,  ///< equal bodies move differently
  loading_changed,     ///< an equal file loads as other bodies
  scene_changed,       ///< the scene's file is not that of the goldens
  renderer_changed,    ///< equal poses are drawn differently
  missing,             ///< a golden, the sidecar or the track is missing, or a picture's golden poses are
  created,             ///< all goldens are missing: the case is new
  environment,         ///< pictures beyond the tolerance, on a renderer other than the goldens'
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

/// Returns the verdict of a name; Verdict::error for an unknown name.
inline Verdict verdict_named(std::string_view name) {
  const auto found = std::ranges::find(verdict_names, name);
  return found == verdict_names.end() ? Verdict::error : static_cast<Verdict>(found - verdict_names.begin());
}

/// Returns 1 with orphans or a verdict worse than environment; else 3 with environment, 0 without.
inline int exit_code(std::span<const Verdict> cases, std::size_t orphans) {
  const Verdict gravest = cases.empty() ? Verdict::pass : std::ranges::min(cases);
  if (orphans > 0 || gravest < Verdict::environment) return 1;
  return gravest == Verdict::environment ? 3 : 0;
}

/// Returns the numbers of passes and of all else that occurs: "3 simulation changed, 1 orphan, 30 pass".
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
