#include "sim/model/usual_settings.h"

namespace substep {

Settings usual_settings(const Scene& scene, Algorithm algorithm) {
  Settings settings = default_settings(algorithm);
  settings.step = scene.step;
  if (is_of_report(algorithm)) settings.substeps = scene.substeps;
  if (algorithm == Algorithm::a2) settings.iterations = scene.substeps;
  return settings;
}

}  // namespace substep
