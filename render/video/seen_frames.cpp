#include "render/video/seen_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/model/state.h"

namespace substep::render {
namespace {

/// How far from its start any body of the run gets, m.
double farthest_way(const Run& run) {
  double farthest = 0;
  for (const std::vector<Coordinates>& frame : run.poses) {
    for (std::size_t body = 1; body < frame.size(); ++body) {
      const double way = (frame[body].linear - run.poses.front()[body].linear).norm();
      farthest = std::max(farthest, std::isfinite(way) ? way : std::numeric_limits<double>::max());
    }
  }
  return farthest;
}

}  // namespace

std::vector<std::vector<Coordinates>> seen_frames(const Scene& scene, const Comparison& comparison) {
  std::vector<std::vector<Coordinates>> frames{initial_state(scene).q};
  // Of each run, a hundred frames say where its bodies go.
  const std::size_t stride = std::max<std::size_t>(1, comparison.times.size() / 100);
  const auto add = [&](const std::vector<std::vector<Coordinates>>& poses, std::size_t end) {
    for (std::size_t k = 0; k < end; k += stride) frames.push_back(poses[k]);
  };
  if (comparison.reference && 2 * comparison.reference->known >= comparison.times.size()) {
    add(comparison.reference->poses, comparison.reference->known);
    return frames;
  }
  std::vector<std::pair<double, const Run*>> runs;
  for (const Run& run : comparison.runs) {
    if (!run.is_reference() && !run.poses.empty()) runs.emplace_back(farthest_way(run), &run);
  }
  std::ranges::stable_sort(runs, {}, [](const auto& run) { return run.first; });
  for (std::size_t i = 0; i < (runs.size() + 1) / 2; ++i)
    add(runs[i].second->poses, runs[i].second->poses.size());
  return frames;
}

}  // namespace substep::render
