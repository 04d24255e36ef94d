#include "sim/measure/stability_map.h"

#include <cmath>

#include "sim/measure/weight_scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr double offset = 0.001;  // m

/// A weight on a ball joint that is off by 1 mm: three rows, each the scalar row.
Scene weight_off_its_joint() {
  JointLimit locked;
  locked.axes = {true, true, true};
  locked.min = locked.max = 0;
  return weight_on_a_joint(offset, locked);
}

bool is_stable(const Scene& scene, Algorithm algorithm, const Stabilization& by) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.substeps = 8;
  settings.tau = by.tau;
  settings.kappa = by.kappa;
  Simulation simulation(scene, settings);
  // 1600 applications of the row: at 0.1 from the border in τ the amplitude changes by far more than a half.
  for (int i = 0; i < 200; ++i) {
    if (simulation.step().status == StepReport::Status::diverged) return false;
  }
  return std::abs(simulation.state().q[1].linear.y()) < offset;
}

}  // namespace

std::vector<StabilityPoint> measure_stability_map() {
  const Scene scene = weight_off_its_joint();
  std::vector<StabilityPoint> points;
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (int k = 0; k < 10; ++k) {
      for (int t = 0; t < 20; ++t) {
        const double kappa = 0.1 + 0.2 * k;
        const double tau = 0.1 + 0.2 * t;
        points.push_back({algorithm, tau, kappa, is_stable(scene, algorithm, {tau, kappa})});
      }
    }
  }
  return points;
}

StabilityMatch match_closed_form(const std::vector<StabilityPoint>& points) {
  StabilityMatch match;
  for (const StabilityPoint& point : points) {
    ++match.points;
    if (point.stable != (point.tau < stability_border(point.kappa))) ++match.wrong;
  }
  return match;
}

}  // namespace substep
