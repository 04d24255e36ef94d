#include "sim/loading/needed_substeps.h"

#include <algorithm>
#include <cmath>

#include "sim/model/settings.h"

namespace substep {

double mass_ratio(const Scene& scene) {
  double least = 0;
  double most = 0;
  for (const Body& body : scene.bodies) {
    if (body.inverse_mass == 0) continue;
    least = least == 0 ? body.inverse_mass : std::min(least, body.inverse_mass);
    most = std::max(most, body.inverse_mass);
  }
  return least == 0 ? 1 : most / least;
}

int needed_substeps(const Scene& scene) {
  const double enough_for_most = default_settings(Algorithm::a5).substeps;
  constexpr double at_most = 100;
  return static_cast<int>(std::ceil(std::clamp(std::sqrt(2 * mass_ratio(scene)), enough_for_most, at_most)));
}

}  // namespace substep
