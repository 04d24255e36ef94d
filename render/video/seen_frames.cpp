#include "render/video/seen_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/video/film_camera.h"
#include "sim/measure/motion.h"
#include "sim/model/state.h"

namespace substep::render {
namespace {

/// Returns how far a body is from `middle` at most, m.
double farthest(const Vector3& middle, const std::vector<Coordinates>& poses) {
  double result = 0;
  for (std::size_t body = 1; body < poses.size(); ++body) {
    const double distance = (poses[body].linear - middle).norm();
    result = std::max(result, std::isfinite(distance) ? distance : std::numeric_limits<double>::max());
  }
  return result;
}

}  // namespace

std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison) {
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  // Of each run, a hundred frames say where its bodies go.
  const std::size_t stride = std::max<std::size_t>(1, comparison.times.size() / 100);
  const Vector3 middle = middle_of(scene);
  std::vector<double> reaches;
  for (const Run& run : comparison.runs) {
    double& reach = reaches.emplace_back(0);
    for (const std::vector<Coordinates>& poses : run.poses) reach = std::max(reach, farthest(middle, poses));
  }
  std::ranges::sort(reaches);
  const double calm = reaches.empty() ? 0 : reaches[(reaches.size() - 1) / 2];
  const double most = std::max(1.1 * calm, 0.65 * size_of(scene));
  for (const Run& run : comparison.runs) {
    for (std::size_t k = 0; k < run.poses.size(); k += stride) {
      if (farthest(middle, run.poses[k]) > most) break;
      frames.push_back(run.poses[k]);
    }
  }
  return frames;
}

}  // namespace substep::render
