#pragma once
/// What algorithms and families of runs look like in figures.

#include <string>

#include "render/report/plot.h"
#include "sim/study/sweep_results.h"

namespace substep {

/// "A1" … "A5".
std::string title_of(Algorithm algorithm);

Look look_of(Algorithm algorithm);

/// Stable joints, stabilization and few iterations are dashed. `contacts`: whether the scene has contacts.
Look look_of(const RunFamily& family, bool contacts);

}  // namespace substep
