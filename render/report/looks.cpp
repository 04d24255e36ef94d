#include "render/report/looks.h"

#include <array>

#include "sim/study/engines/engines.h"

namespace substep {

Look look_of(Algorithm algorithm) {
  constexpr std::array<Look, 5> looks{{{0, 7, false, true, true},
                                       {1, 5, false, true, true},
                                       {2, 9, false, true, true},
                                       {3, 13, false, true, true},
                                       {4, 11, false, true, true}}};
  return looks.at(static_cast<std::size_t>(algorithm));
}

Look look_of(const RunFamily& family, bool contacts) {
  const SweepRecord& record = family.runs.front();
  if (!record.engine.empty()) {
    Look look{5, 4, false, true, true};
    for (std::size_t i = 0; i < engines().size(); ++i) {
      if (engines()[i].name != record.engine) continue;
      constexpr std::array hues{5, 6, 7};
      constexpr std::array shapes{4, 8, 10, 12, 1, 3, 6, 2};
      look.hue = hues[i % hues.size()];
      look.shape = shapes[i % shapes.size()];
    }
    return look;
  }
  Look look = look_of(record.settings.algorithm);
  look.dashed = record.settings.joints == Joints::stable || record.settings.tau != 1 ||
                (record.settings.algorithm == Algorithm::a2 && !contacts && record.settings.iterations < 16);
  // Discs, squares and triangles have empty twins at the number before.
  if (look.dashed) look.shape -= 1;
  return look;
}

}  // namespace substep
