#pragma once
/// Warnings of commands about runs that went wrong.

#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/scene/scene.h"

namespace substep {

/// Prints a line on stderr for each violation of the run that `label` names, and marks those for which the
/// run is not bounded.
void warn_of(const Scene& scene, const std::string& label, const std::vector<Violation>& violations);

}  // namespace substep
