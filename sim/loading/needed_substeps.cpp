#include "sim/loading/needed_substeps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/model/usual_settings.h"

namespace substep {

namespace {

double substeps_for_masses(const Scene& scene) {
  return std::ceil(std::sqrt(2 * mass_ratio(scene)));
}

}  // namespace

int needed_substeps(const Scene& scene) {
  const double enough =
      has_loop(scene, Springs::skip) ? substeps_in_loop : default_settings(Algorithm::a5).substeps;
  return static_cast<int>(std::clamp<double>(substeps_for_masses(scene), enough, most_default_substeps));
}

int most_substeps_of_a5(const Scene& scene) {
  if (has_loop(scene, Springs::skip)) return substeps_in_loop;
  return has_loop(scene, Springs::count) ? 20 : most_default_substeps;
}

std::string doubt_about_substeps(const Scene& scene, const Settings& settings) {
  if (settings.algorithm == Algorithm::a1 || !is_of_report(settings.algorithm)) return "";
  const int given = settings.algorithm == Algorithm::a2 ? settings.iterations : settings.substeps;
  const double asked = substeps_for_masses(scene);
  if (asked > most_default_substeps && given < asked) {
    return fmt::format(
        "its heaviest body is {:.3g} times as heavy as its lightest, which asks for {:.0f} sub-steps, and "
        "not "
        "{}: light bodies give way under heavy ones",
        mass_ratio(scene), asked, given);
  }
  const int most = most_substeps_of_a5(scene);
  if (settings.algorithm == Algorithm::a5 && settings.joints == Joints::stable && !scene.joints.empty() &&
      given > most) {
    return fmt::format("A5 gets worse with more than {} sub-steps where there are {}", most,
                       most == most_default_substeps ? "joints" : "loops of joints");
  }
  return "";
}

}  // namespace substep
