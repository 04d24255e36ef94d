#include "render/report/looks.h"

#include <array>

#include "render/inks.h"
#include "sim/study/engines/engines.h"

namespace substep::report {

Look look_of(Algorithm algorithm) {
  constexpr std::array shapes{7, 5, 9, 13, 11, 3, 1};
  return {render::hue_of(algorithm), shapes.at(static_cast<std::size_t>(algorithm)), false, true, true};
}

Look look_of(const RunFamily& family, bool contacts) {
  const SweepRecord& record = family.runs.front();
  if (!record.engine.empty()) {
    Look look{5, 4, false, true, true};
    for (std::size_t i = 0; i < engines().size(); ++i) {
      if (engines()[i].name != record.engine) continue;
      constexpr std::array shapes{4, 8, 10, 12, 1, 3, 6, 2};
      look.hue = render::hue_of_engine(record.engine);
      look.shape = shapes[i % shapes.size()];
    }
    return look;
  }
  Look look = look_of(record.settings.algorithm);
  look.dashed = record.settings.joints == Joints::stable || record.settings.tau != 1 ||
                (record.settings.algorithm == Algorithm::a2 && !contacts && record.settings.iterations < 16);
  // The number before that of a filled disc, square or triangle is the empty one.
  if (look.dashed) look.shape -= 1;
  return look;
}

}  // namespace substep::report
