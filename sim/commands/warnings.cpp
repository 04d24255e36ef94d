#include "sim/commands/warnings.h"

#include <fmt/format.h>

#include <cstdio>

namespace substep {

void warn_of(const Scene& scene, const std::string& label, const std::vector<Violation>& violations) {
  std::fflush(stdout);
  for (const Violation& violation : violations) {
    const bool is_bounded = violation.severity == Violation::Severity::warning;
    fmt::print(stderr, "substep: warning: {}: {}: {}{}\n", scene.name, label,
               is_bounded ? "" : "not bounded: ", violation.text);
  }
}

}  // namespace substep
