#include "golden/compare/verdict.h"

#include <fmt/format.h>

#include <algorithm>

namespace substep::golden {

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::error:
      return "error";
    case Verdict::golden_edited:
      return "golden edited";
    case Verdict::scene_changed:
      return "scene changed";
    case Verdict::loading_changed:
      return "loading changed";
    case Verdict::simulation_changed:
      return "simulation changed";
    case Verdict::renderer_changed:
      return "renderer changed";
    case Verdict::both_changed:
      return "both changed";
    case Verdict::environment:
      return "environment";
    case Verdict::missing:
      return "missing";
    case Verdict::created:
      return "new";
  }
  return "?";
}

std::optional<Verdict> verdict_named(std::string_view wanted) {
  const auto found = std::find_if(verdicts.begin(), verdicts.end(),
                                  [&](Verdict verdict) { return name(verdict) == wanted; });
  return found == verdicts.end() ? std::nullopt : std::optional(*found);
}

int exit_code(std::span<const Verdict> cases, std::size_t orphans) {
  const auto fails = [](Verdict verdict) {
    return verdict != Verdict::pass && verdict != Verdict::environment;
  };
  if (orphans > 0 || std::any_of(cases.begin(), cases.end(), fails)) return 1;
  return std::find(cases.begin(), cases.end(), Verdict::environment) == cases.end() ? 0 : 3;
}

std::string totals(std::span<const Verdict> cases, std::size_t orphans) {
  std::string text;
  const auto add = [&](std::ptrdiff_t count, std::string_view what) {
    if (count > 0) text += fmt::format("{} {}, ", count, what);
  };
  for (const Verdict verdict : verdicts) {
    if (verdict != Verdict::pass) add(std::count(cases.begin(), cases.end(), verdict), name(verdict));
  }
  add(static_cast<std::ptrdiff_t>(orphans), "orphan");
  return text + fmt::format("{} pass", std::count(cases.begin(), cases.end(), Verdict::pass));
}

}  // namespace substep::golden
