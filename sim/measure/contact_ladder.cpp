#include "sim/measure/contact_ladder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/error.h"
#include "sim/measure/metrics.h"

namespace substep {
namespace {

/// What is measured of a scene: less is better.
enum class Price { displacement, distance, speed };

struct PricedScene {
  std::string_view name;
  Price price;
  double duration;  ///< s
};

constexpr std::array<PricedScene, 6> priced_scenes{{{"box_stack", Price::displacement, 5},
                                                    {"heavy_on_light", Price::displacement, 5},
                                                    {"box_pyramid", Price::displacement, 2},
                                                    {"balls_on_tray", Price::distance, 2},
                                                    {"powered_wheel", Price::distance, 2},
                                                    {"dominoes", Price::speed, 4}}};

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
double price_of(const Scene& scene, const PricedScene& priced, const std::vector<Centres>& path,
                ContactRung rung) {
  Simulation simulation(scene, usual_settings(scene, Algorithm::a5), contact_reading(rung));
  const Centres start = centres_of(simulation.state());
  double largest = 0;
  for (int k = 0; k < steps_of(priced.duration, scene.step); ++k) {
    if (simulation.step().status == StepReport::Status::diverged) {
      return std::numeric_limits<double>::infinity();
    }
    const State& state = simulation.state();
    largest = std::max(largest, priced.price == Price::speed ? largest_speed(state)
                                : priced.price == Price::distance
                                    ? largest_distance(state, path[static_cast<std::size_t>(k)])
                                    : largest_distance(state, start));
  }
  return largest;
}

std::string text_of(const PricedScene& priced) {
  switch (priced.price) {
    case Price::displacement:
      return fmt::format("largest displacement of a body in {:g} s", priced.duration);
    case Price::distance:
      return fmt::format("largest distance of a body from A1 at h/8 in {:g} s", priced.duration);
    case Price::speed:
      break;
  }
  return fmt::format("fastest body in {:g} s", priced.duration);
}

ContactPrices prices_of(const std::filesystem::path& folder, const PricedScene& priced) {
  const Scene scene = load_scene(folder / (std::string(priced.name) + ".gltf"));
  std::vector<Centres> path;
  if (priced.price == Price::distance) path = reference_path(scene, priced.duration);
  ContactPrices prices{scene.name, text_of(priced), priced.price == Price::speed ? "m/s" : "m", {}};
  for (const ContactRung rung : contact_rungs) prices.prices.push_back(price_of(scene, priced, path, rung));
  return prices;
}

}  // namespace

std::string column_title(const ContactPrices& prices) {
  return fmt::format("{} [{}]", prices.scene, prices.unit);
}

std::string row_title(ContactRung rung) {
  return std::string(name(rung)) + (is_beyond_report(rung) ? " *" : "");
}

std::string contact_ladder_caption(const std::vector<ContactPrices>& ladder) {
  const Settings settings = default_settings(Algorithm::a5);
  std::string text = fmt::format(
      "The ladder of contacts: A5 at the default settings (n = {}, m = {}, τ = {:g}, κ = {:g}, {} joints, "
      "scene's step) with one of six readings of contacts taken out. ",
      settings.substeps, settings.iterations, settings.tau, settings.kappa, name(settings.joints));
  for (std::size_t i = 0; i < ladder.size(); ++i) {
    const bool is_last = i + 1 == ladder.size();
    const bool goes_on = !is_last && ladder[i + 1].what == ladder[i].what;
    text += ladder[i].scene;
    text += goes_on ? ", " : fmt::format(": {}{}", ladder[i].what, is_last ? ". " : "; ");
  }
  return text + "Four are readings of what the report leaves open; *: the two that go beyond it";
}

std::vector<ContactPrices> contact_ladder(const std::filesystem::path& folder) {
  std::vector<ContactPrices> ladder;
  for (const PricedScene& priced : priced_scenes) ladder.push_back(prices_of(folder, priced));
  return ladder;
}

ContactPrices contact_prices(const std::filesystem::path& folder, const std::string& scene) {
  const auto found = std::ranges::find(priced_scenes, scene, &PricedScene::name);
  if (found == priced_scenes.end()) throw Error(fmt::format("no scene of the ladder of contacts: {}", scene));
  return prices_of(folder, *found);
}

}  // namespace substep
