#pragma once
/// What algorithms and families of runs look like in figures.

#include "render/report/plot.h"
#include "sim/study/sweep_results.h"

namespace substep::report {

Look look_of(Algorithm algorithm);

/// Stable joints, stabilization and few iterations are dashed. `contacts`: whether the scene has contacts.
Look look_of(const RunFamily& family, bool contacts);

}  // namespace substep::report
