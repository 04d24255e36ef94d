#pragma once
/// What algorithms and families of runs look like in figures.

#include "render/report/plot.h"
#include "sim/study/sweep_results.h"

namespace substep::report {

/// Marks of a point of a map: right, usable, lost.
inline constexpr Look good_mark{2, 7, false, false, true};
inline constexpr Look fair_mark{1, 9, false, false, true};
inline constexpr Look lost_mark{4, 2, false, false, true};

Look look_of(Algorithm algorithm);

/// Stable joints, stabilization and few iterations are dashed. `contacts`: whether the scene has contacts.
Look look_of(const RunFamily& family, bool contacts);

}  // namespace substep::report
