#include "render/video/seen_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/measure/motion.h"
#include "sim/model/state.h"

namespace substep::render {
namespace {

/// How far from its start a body is farthest, m.
double farthest_way(const std::vector<Coordinates>& start, const std::vector<Coordinates>& poses) {
  double farthest = 0;
  for (std::size_t body = 1; body < poses.size(); ++body) {
    const double way = (poses[body].linear - start[body].linear).norm();
    farthest = std::max(farthest, std::isfinite(way) ? way : std::numeric_limits<double>::max());
  }
  return farthest;
}

/// The same in a whole run.
double farthest_way(const Run& run) {
  double farthest = 0;
  for (const std::vector<Coordinates>& poses : run.poses)
    farthest = std::max(farthest, farthest_way(run.poses.front(), poses));
  return farthest;
}

}  // namespace

std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison) {
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  // Of each run, a hundred frames say where its bodies go.
  const std::size_t stride = std::max<std::size_t>(1, comparison.times.size() / 100);
  std::vector<double> ways;
  for (const Run& run : comparison.runs) ways.push_back(farthest_way(run));
  std::ranges::sort(ways);
  const double calm = ways.empty() ? 0 : ways[(ways.size() - 1) / 2];
  const double most = std::max(2 * calm, size_of(scene));
  for (const Run& run : comparison.runs) {
    for (std::size_t k = 0; k < run.poses.size(); k += stride) {
      if (farthest_way(run.poses.front(), run.poses[k]) > most) break;
      frames.push_back(run.poses[k]);
    }
  }
  return frames;
}

}  // namespace substep::render
