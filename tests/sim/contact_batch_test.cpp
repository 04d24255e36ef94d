// Contacts four pairs at a time against a sweep row by row.

#include "sim/contact_batch.h"

#include <gtest/gtest.h>

#include "sim/algorithms.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

/// The same listing without batches: an experiment's contacts are among the blocks.
Procedure row_by_row(Algorithm algorithm) {
  return algorithm == Algorithm::a2   ? proc2
         : algorithm == Algorithm::a3 ? proc3
         : algorithm == Algorithm::a4 ? proc4
                                      : proc5;
}

class Batched : public testing::TestWithParam<const char*> {};

TEST_P(Batched, HasTheBitsOfASweepRowByRow) {
  const Scene scene = load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/" + GetParam() + ".gltf");
  for (const Algorithm algorithm : {Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    Settings settings;
    settings.algorithm = algorithm;
    settings.substeps = 3;
    settings.iterations = 2;
    settings.tau = 0.3;
    settings.kappa = 0.9;
    settings.relaxation = 1.1;
    settings.tolerance = 1e-6;
    Simulation batched(scene, settings);
    Simulation rows(scene, settings, row_by_row(algorithm));
    for (int step = 1; step <= 90; ++step) {
      const StepReport& report = batched.step();
      const StepReport& expected = rows.step();
      ASSERT_EQ(report.row_solves, expected.row_solves) << name(algorithm) << " step " << step;
      ASSERT_EQ(report.rows, expected.rows) << name(algorithm) << " step " << step;
      ASSERT_EQ(hash(batched.state()), hash(rows.state())) << name(algorithm) << " step " << step;
    }
  }
}

// Stacks, heaps, joints with contacts, restitution, frictionless pairs, moved bodies.
INSTANTIATE_TEST_SUITE_P(Scenes, Batched,
                         testing::Values("stone_pyramid", "dominoes", "wrecking_ball", "water_wheel",
                                         "bouncing_balls", "cradle", "incline", "conveyor", "card_house"),
                         [](const auto& name) { return std::string(name.param); });

TEST(ContactBatches, PairsOfOneBatchShareNoMovingBody) {
  const Scene scene = load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/stone_pyramid.gltf");
  const Model model = build_model(scene);
  ContactFinder finder(scene, model);
  const std::vector<Contact>& found = finder.find(initial_state(scene), 1.0 / 60);
  ContactBatches contacts;
  contacts.build(model, found);
  int rows = 0;
  int pairs = 0;
  for (const ContactBatch& x : contacts.batches) {
    rows += x.pairs * x.count;
    pairs += x.pairs;
    for (int one = 0; one < x.pairs; ++one) {
      for (int other = 0; other < one; ++other) {
        for (const int body : {x.a[one], x.b[one]}) {
          if (model.masses[body].inverse_mass == 0) continue;
          EXPECT_NE(body, x.a[other]);
          EXPECT_NE(body, x.b[other]);
        }
      }
    }
  }
  EXPECT_EQ(rows, contacts.row_count);
  EXPECT_LT(std::ssize(contacts.batches), pairs);  // measured 19 and 25: a small heap has long chains
}

}  // namespace
}  // namespace substep
