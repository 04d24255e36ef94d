#include "sim/measure/contact_ablation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/measure/metrics.h"

namespace substep {
namespace {

/// The cost that is measured on a scene: less is better.
enum class Cost { displacement, distance, speed };

struct AblatedScene {
  std::string_view name;
  Cost cost;
  double duration;  ///< s
};

constexpr std::array<AblatedScene, 5> ablated_scenes{{{"box_stack", Cost::displacement, 5},
                                                      {"box_pyramid", Cost::displacement, 2},
                                                      {"balls_on_tray", Cost::distance, 2},
                                                      {"powered_wheel", Cost::distance, 2},
                                                      {"dominoes", Cost::speed, 4}}};

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

double largest_speed(const State& state) {
  double largest = 0;
  for (std::size_t i = 1; i < state.v.size(); ++i) largest = std::max(largest, state.v[i].linear.norm());
  return largest;
}

/// The largest value after any step. `path`: for distances alone.
double cost_of_run(const Scene& scene, const AblatedScene& ablated, const std::vector<Centres>& path,
                   const Settings& settings, const ContactReading& reading) {
  Simulation simulation(scene, settings, reading);
  const Centres start = centres_of(simulation.state());
  double largest = 0;
  for (int k = 0; k < steps_of(ablated.duration, scene.step); ++k) {
    if (simulation.step().status == StepReport::Status::diverged) {
      return std::numeric_limits<double>::infinity();
    }
    const State& state = simulation.state();
    largest = std::max(largest, ablated.cost == Cost::speed ? largest_speed(state)
                                : ablated.cost == Cost::distance
                                    ? largest_distance(state, path[static_cast<std::size_t>(k)])
                                    : largest_distance(state, start));
  }
  return largest;
}

std::string text_of(const AblatedScene& ablated) {
  switch (ablated.cost) {
    case Cost::displacement:
      return fmt::format("largest displacement of a body in {:g} s", ablated.duration);
    case Cost::distance:
      return fmt::format("largest distance of a body from A1 at h/8 in {:g} s", ablated.duration);
    case Cost::speed:
      break;
  }
  return fmt::format("fastest body in {:g} s", ablated.duration);
}

struct Run {
  Settings settings;
  ContactReading reading;
};

/// `runs_of` gives the runs of the scene.
template <typename RunsOf>
ContactAblationCosts costs_of(const std::filesystem::path& folder, const AblatedScene& ablated,
                              const RunsOf& runs_of) {
  const Scene scene = load_scene(folder / (std::string(ablated.name) + ".gltf"));
  std::vector<Centres> path;
  if (ablated.cost == Cost::distance) path = reference_path(scene, ablated.duration);
  ContactAblationCosts costs{scene.name, text_of(ablated), ablated.cost == Cost::speed ? "m/s" : "m", {}};
  for (const Run& run : runs_of(scene))
    costs.costs.push_back(cost_of_run(scene, ablated, path, run.settings, run.reading));
  return costs;
}

std::vector<Run> ablations_of(const Scene& scene) {
  std::vector<Run> runs;
  Settings settings = default_settings(Algorithm::a5);
  settings.step = scene.step;
  for (const ContactAblation approximation : contact_ablations)
    runs.push_back({settings, contact_reading(approximation)});
  return runs;
}

const AblatedScene& ablated_scene(const std::string& name) {
  const auto* const found = std::ranges::find(ablated_scenes, name, &AblatedScene::name);
  if (found == ablated_scenes.end())
    throw Error(fmt::format("no scene of the ablation of contacts: {}", name));
  return *found;
}

}  // namespace

std::string column_title(const ContactAblationCosts& costs) {
  return fmt::format("{} [{}]", costs.scene, costs.unit);
}

std::string contact_ablation_caption(const std::vector<ContactAblationCosts>& ablation) {
  const Settings settings = default_settings(Algorithm::a5);
  std::string text = fmt::format(
      "A5 with n = {}, m = {}, τ = {} and κ = {} (of joints/contacts), {} joints, and one option of contacts "
      "switched off. ",
      settings.substeps, settings.iterations, tau_text(settings), kappa_text(settings),
      name(settings.joints));
  for (std::size_t i = 0; i < ablation.size(); ++i) {
    const bool is_last = i + 1 == ablation.size();
    const bool goes_on = !is_last && ablation[i + 1].what == ablation[i].what;
    text += ablation[i].scene;
    text += goes_on ? ", " : fmt::format(": {}{}", ablation[i].what, is_last ? ". " : "; ");
  }
  return text + "Less is better";
}

std::vector<ContactAblationCosts> contact_ablation(const std::filesystem::path& folder) {
  std::vector<ContactAblationCosts> ablation;
  for (const AblatedScene& ablated : ablated_scenes)
    ablation.push_back(costs_of(folder, ablated, ablations_of));
  return ablation;
}

ContactAblationCosts contact_costs(const std::filesystem::path& folder, const std::string& scene,
                                   const std::vector<Settings>& settings) {
  return costs_of(folder, ablated_scene(scene), [&](const Scene& loaded) {
    std::vector<Run> runs;
    for (Settings each : settings) {
      each.step = loaded.step;
      runs.push_back({each, {}});
    }
    return runs;
  });
}

}  // namespace substep
