// The half-rungs between A3 and A4: the ends of the ladder are the algorithms themselves. The ladder of
// contacts: its first rung is A5, and each of the others costs something.

#include "sim/ladder.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "sim/measure/contact_ladder.h"

#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::position_difference;

Scene tumbling_chain() {
  Scene scene = test::chain(3, 0.3);
  scene.joints[2].limits.push_back(test::locked(true, {true, true, false}));
  scene.bodies[1].angular_velocity = {0.5, 1, 0};
  scene.bodies[3].angular_velocity = {1, -0.5, 2};
  return scene;
}

/// A box that falls on its edge and slides: contacts with friction.
Scene sliding_box() {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  return scene;
}

State climb(const Scene& scene, Rung rung, const Settings& settings, int steps) {
  Simulation simulation(scene, settings, ladder_procedure(rung));
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

State run(const Scene& scene, Algorithm algorithm, Settings settings, int steps) {
  settings.algorithm = algorithm;
  Simulation simulation(scene, settings);
  for (int i = 0; i < steps; ++i) simulation.step();
  return simulation.state();
}

TEST(Ladder, WithoutApproximationIsA3ToTheBit) {
  for (const Scene& scene : {tumbling_chain(), sliding_box()}) {
    for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
      Settings settings;
      settings.joints = joints;
      settings.iterations = 2;
      settings.tau = 0.7;
      settings.kappa = 0.9;
      EXPECT_EQ(hash(climb(scene, Rung::exact, settings, 60)), hash(run(scene, Algorithm::a3, settings, 60)));
    }
  }
}

TEST(Ladder, WithAllOfA4sIsA4) {
  for (const Joints joints : {Joints::rows, Joints::plain, Joints::stable}) {
    Settings settings;
    settings.joints = joints;
    settings.tau = 0.7;
    settings.kappa = 0.9;
    const State all = climb(tumbling_chain(), Rung::all_of_a4, settings, 60);
    const State a4 = run(tumbling_chain(), Algorithm::a4, settings, 60);
    EXPECT_LT(position_difference(all, a4), 1e-12) << name(joints);  // measured 0
    EXPECT_GT(position_difference(a4, run(tumbling_chain(), Algorithm::a3, settings, 60)), 1e-4);
  }
  const Settings settings;
  const State all = climb(sliding_box(), Rung::all_of_a4, settings, 20);
  EXPECT_LT(position_difference(all, run(sliding_box(), Algorithm::a4, settings, 20)), 1e-12);  // measured 0
}

// Every switch switches something; the frozen Jacobian is the dear one, and dearer alone than with the bias
// update that belongs to it.
TEST(Ladder, EachApproximationHasAPriceOfItsOwn) {
  const Scene scene = tumbling_chain();
  const Settings settings;
  const State a3 = run(scene, Algorithm::a3, settings, 60);
  const auto price = [&](Rung rung) { return position_difference(climb(scene, rung, settings, 60), a3); };
  const double all = price(Rung::all_of_a4);  // measured 0.032 m
  for (const Rung rung : {Rung::bias_update, Rung::summed_rotation, Rung::current_jacobian_bias}) {
    EXPECT_GT(price(rung), 1e-6) << name(rung);
    EXPECT_LT(price(rung), 0.2 * all) << name(rung);  // measured 0.019, 0.012, 0.041
  }
  EXPECT_GT(price(Rung::frozen_jacobian), all);  // measured 2.9 times as dear
}

TEST(ContactLadder, AllSixAreASimulationToTheBit) {
  const Scene scene = sliding_box();
  for (const Algorithm algorithm : {Algorithm::a2, Algorithm::a5}) {
    Simulation simulation(scene, default_settings(algorithm), contact_reading(ContactRung::all_six));
    for (int i = 0; i < 60; ++i) simulation.step();
    EXPECT_EQ(hash(simulation.state()), hash(run(scene, algorithm, default_settings(algorithm), 60)));
  }
}

struct Price {
  ContactRung rung;
  const char* scene;
  double factor;  ///< at least so much worse than with all six
};

// Where each reading is needed most, of the scenes that are measured fast.
TEST(ContactLadder, EachReadingHasAPriceOfItsOwn) {
  std::map<std::string, std::vector<double>> measured;
  const std::string folder = std::string(SUBSTEP_SOURCE_DIR) + "/scenes";
  for (const Price& price : {Price{ContactRung::velocity_level, "powered_wheel", 40},         // measured 48
                             Price{ContactRung::square_friction, "balls_on_tray", 200},       // measured 329
                             Price{ContactRung::limits_by_substep, "heavy_on_light", 50},     // measured 483
                             Price{ContactRung::file_order, "heavy_on_light", 5},             // measured 13
                             Price{ContactRung::single_normals, "box_stack", 4},              // measured 5.2
                             Price{ContactRung::forgetting_friction, "balls_on_tray", 5}}) {  // measured 7.4
    std::vector<double>& prices = measured[price.scene];
    if (prices.empty()) prices = contact_prices(folder, price.scene).prices;
    EXPECT_GT(prices.at(static_cast<std::size_t>(price.rung)), price.factor * prices.front())
        << name(price.rung) << " on " << price.scene;
  }
  EXPECT_LT(measured["box_stack"].front(), 0.005);      // measured 0.00405 m
  EXPECT_LT(measured["balls_on_tray"].front(), 0.003);  // measured 0.00242 m
  EXPECT_LT(measured["powered_wheel"].front(), 0.015);  // measured 0.0117 m
  EXPECT_LT(measured["heavy_on_light"].front(), 0.6);   // measured 0.5 m
}

TEST(ContactLadder, EachRungTakesOneReadingOut) {
  for (const ContactRung rung : contact_rungs) {
    const ContactReading x = contact_reading(rung);
    const int held = x.velocity_level_apart + x.isotropic_friction + x.limits_over_step + x.far_first +
                     x.manifold_blocks + x.friction_memory;
    EXPECT_EQ(held, rung == ContactRung::all_six ? 6 : 5) << name(rung);
  }
}

}  // namespace
}  // namespace substep
