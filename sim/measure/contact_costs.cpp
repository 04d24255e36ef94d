#include "sim/measure/contact_costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

struct CostedScene {
  std::string_view name;
  bool from_reference;  ///< the cost is a distance from A1, else a displacement from the start
  double duration;      ///< s
};

constexpr std::array<CostedScene, 3> costed_scenes{
    {{"box_stack", false, 5}, {"box_pyramid", false, 2}, {"balls_on_tray", true, 2}}};

using Centres = std::vector<Vector3>;

Centres centres_of(const State& state) {
  Centres centres;
  for (const Coordinates& q : state.q) centres.push_back(q.linear);
  return centres;
}

int steps_of(double duration, double step) {
  return static_cast<int>(std::lround(duration / step));
}

/// Where A1 has the bodies at the end of each step of the scene's; it steps eight times as often.
std::vector<Centres> reference_path(const Scene& scene, double duration) {
  constexpr int divisions = 8;
  Settings settings;
  settings.algorithm = Algorithm::a1;
  settings.step = scene.step / divisions;
  Simulation simulation(scene, settings);
  std::vector<Centres> path;
  for (int k = 0; k < steps_of(duration, scene.step); ++k) {
    for (int i = 0; i < divisions; ++i) simulation.step();
    path.push_back(centres_of(simulation.state()));
  }
  return path;
}

double largest_distance(const State& state, const Centres& from) {
  double largest = 0;
  for (std::size_t i = 1; i < from.size(); ++i) {
    largest = std::max(largest, (state.q[i].linear - from[i]).norm());
  }
  return largest;
}

/// Returns the largest distance after any step from the start, or from where `path` has the bodies.
double cost_of_run(const Scene& scene, double duration, const std::vector<Centres>& path,
                   const Settings& settings) {
  Simulation simulation(scene, settings);
  const Centres start = centres_of(simulation.state());
  double largest = 0;
  for (int k = 0; k < steps_of(duration, scene.step); ++k) {
    if (simulation.step().status == StepReport::Status::diverged) {
      return std::numeric_limits<double>::infinity();
    }
    const Centres& from = path.empty() ? start : path[static_cast<std::size_t>(k)];
    largest = std::max(largest, largest_distance(simulation.state(), from));
  }
  return largest;
}

}  // namespace

ContactCosts contact_costs(const std::filesystem::path& folder, const std::string& scene,
                           const std::vector<Settings>& settings) {
  const auto* const costed = std::ranges::find(costed_scenes, scene, &CostedScene::name);
  if (costed == costed_scenes.end()) throw Error(fmt::format("contacts are not measured on {}", scene));
  const Scene loaded = load_scene(folder / (scene + ".gltf"));
  std::vector<Centres> path;
  if (costed->from_reference) path = reference_path(loaded, costed->duration);
  ContactCosts costs{
      loaded.name,
      fmt::format("largest {} in {:g} s",
                  costed->from_reference ? "distance of a body from A1 at h/8" : "displacement of a body",
                  costed->duration),
      {}};
  for (Settings each : settings) {
    each.step = loaded.step;
    costs.costs.push_back(cost_of_run(loaded, costed->duration, path, each));
  }
  return costs;
}

}  // namespace substep
