#include "golden/check/motion_page.h"

#include <fmt/format.h>

#include <utility>

#include "render/player/player_page.h"
#include "sim/error.h"

namespace substep::golden {
namespace {

render::ReferenceRun golden_run(const Scene& scene, const Track& golden, std::size_t frames) {
  render::ReferenceRun reference;
  reference.method = "the golden run";
  for (const Track::Frame& frame : golden.frames) {
    if (frame.poses.size() != scene.bodies.size()) {
      throw Error(fmt::format("{}: its golden run is of other bodies", scene.name));
    }
    if (reference.poses.size() < frames) reference.poses.push_back(frame.poses);
  }
  reference.known = reference.poses.size();
  reference.uncertainty.assign(reference.known, Track::resolution);
  if (reference.known < frames) reference.fate = "it ends";
  return reference;
}

}  // namespace

std::string motion_page(const Scene& scene, const Settings& settings,
                        std::span<const std::vector<Coordinates>> live, const Track& golden, int last) {
  render::Comparison comparison;
  for (int k = 0; k <= last; ++k) comparison.times.push_back(k * settings.step);
  render::ReferenceRun reference = golden_run(scene, golden, comparison.times.size());
  comparison.runs.resize(2);
  render::Run& now = comparison.runs[0];
  now.panel.settings = settings;
  now.panel.title = "as it runs now";
  now.poses.assign(live.begin(), live.end());
  render::Run& before = comparison.runs[1];
  before.panel.kind = render::PanelChoice::Kind::reference;
  before.poses = reference.poses;
  render::measure_from(scene, reference, now);
  if (now.poses.size() < comparison.times.size()) now.diverged = comparison.times[now.poses.size()];
  comparison.reference = std::move(reference);
  return render::player_page(scene, comparison, scene.name, 1);
}

}  // namespace substep::golden
