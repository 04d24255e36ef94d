#include "golden/compare/verdict.h"

#include <fmt/format.h>

#include <algorithm>

namespace substep::golden {

Verdict verdict_named(std::string_view name) {
  const auto found = std::find(verdict_names.begin(), verdict_names.end(), name);
  return found == verdict_names.end() ? Verdict::error : static_cast<Verdict>(found - verdict_names.begin());
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
  for (std::size_t i = 0; i + 1 < verdict_names.size(); ++i) {
    add(std::count(cases.begin(), cases.end(), static_cast<Verdict>(i)), verdict_names[i]);
  }
  add(static_cast<std::ptrdiff_t>(orphans), "orphan");
  return text + fmt::format("{} pass", std::count(cases.begin(), cases.end(), Verdict::pass));
}

}  // namespace substep::golden
