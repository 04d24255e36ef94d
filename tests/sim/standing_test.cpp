// Standing bodies stay in place, since the contact cache is part of the state; overlapping bodies separate.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>

#include "sim/scene/scene.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// Returns the largest displacement of any body, or of the one named, within 5 s, m.
double displacement(const char* name, int substeps, const std::string& body = "") {
  const Scene scene = scene_named(name);
  return test::largest_displacement(scene, test::with_substeps(Algorithm::a5, substeps), 5,
                                    body.empty() ? 0 : static_cast<std::size_t>(body_named(scene, body)));
}

struct Standing {
  const char* scene;
  int substeps;
  double limit;  ///< m
  const char* body = "";
};

class StandingScene : public testing::TestWithParam<Standing> {};

TEST_P(StandingScene, StaysInPlace) {
  const auto& [scene, substeps, limit, body] = GetParam();
  const double moved = displacement(scene, substeps, body);
  EXPECT_LT(moved, limit);
  if (substeps == 10) {
    EXPECT_LE(displacement(scene, 30, body), moved);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, StandingScene,
                         testing::Values(Standing{"box_stack", 4, 0.030},         // measured 24.1 mm
                                         Standing{"box_stack", 10, 0.004},        // 3.68; n = 30: 0.37
                                         Standing{"stone_pyramid", 10, 0.001},    // 0.81; 0.07
                                         Standing{"card_house", 10, 0.012},       // 1.79; 0.86
                                         Standing{"tall_stack", 10, 0.017},       // 15.5; 1.6
                                         Standing{"brick_wall", 10, 0.008},       // 4.0; 0.44
                                         Standing{"box_pyramid", 10, 0.030},      // 15.8; 6.1
                                         Standing{"top_heavy_stack", 30, 0.100},  // 78.7
                                         Standing{"heavy_on_light", 30, 0.100},   // 86.8
                                         Standing{"heavy_on_light", 30, 0.010,
                                                  "heavy_4"}),  // 8.6, of 1000 kg
                         [](const auto& standing) {
                           return std::string(standing.param.scene) + "_" +
                                  std::to_string(standing.param.substeps) + standing.param.body;
                         });

TEST(Overlap, RecoversSlowly) {
  const Scene scene = scene_named("overlap");
  for (const int n : {1, 2, 4, 8, 10, 16, 32, 64}) {
    for (const double tau : {0.3, 0.6, 0.9, 1.0}) {
      Settings settings = test::with_substeps(Algorithm::a5, n);
      if (tau != settings.contact_tau) {
        settings.tau = tau;
        settings.contact_tau = settings.contact_kappa = 0;
      }
      const double fastest = test::largest(scene, settings, 5, [](const State& state, double) {
        double most = 0;
        for (const Velocity& v : state.v) most = std::max(most, v.linear.norm());
        return most;
      });
      EXPECT_LT(fastest, 2) << "n = " << n << ", τ = " << tau;  // measured 1.78 m/s (n = 1) … 0.41 (n = 64)
      EXPECT_GT(fastest, 0.1);                                  // they do separate
    }
  }
}

TEST(ContactCache, SortsByColliderAndPosition) {
  for (const char* name : {"balls_on_tray", "funnel", "rock_slide", "seams"}) {
    Simulation simulation(scene_named(name), default_settings(Algorithm::a5));
    for (int step = 1; step <= 40; ++step) {
      simulation.step();
      EXPECT_TRUE(std::ranges::is_sorted(simulation.state().contacts, {},
                                         [](const ContactMemory& memory) {
                                           const Vector3& arm = memory.arm_a;
                                           return std::tuple(memory.collider_a, memory.collider_b, arm[0],
                                                             arm[1], arm[2]);
                                         }))
          << name << ", step " << step;
    }
    // Measured 25, 352, 443 and 29: enough contacts to test their order.
    EXPECT_GT(simulation.state().contacts.size(), 20U) << name;
  }
}

/// Expects that the hash of the state changes with each number of its field.
template <class Field>
void expect_hashed(const State& state, Field&& field) {
  using Number = std::remove_reference_t<Field>;
  if constexpr (std::is_arithmetic_v<Number>) {
    const std::uint64_t before = hash(state);
    const Number value = field;
    if constexpr (std::is_integral_v<Number>) {
      field = !value;
    } else {
      field = std::nextafter(value, value + 1);
    }
    EXPECT_NE(hash(state), before) << value;
    field = value;
  } else {
    for (auto& number : field) expect_hashed(state, number);
  }
}

TEST(StateHash, CoversEveryNumberOfContacts) {
  State state = initial_state(test::floor_scene(0.6));
  const std::uint64_t without = hash(state);
  state.contacts.push_back({3, 5, {0.1, 0.2, 0.3}, {-0.4, 0.5, 0.6}, {1e-5, 2e-5, -3e-5}, false, 0.01});
  EXPECT_NE(hash(state), without);
  ContactMemory& memory = state.contacts[0];
  for (int* integer : {&memory.collider_a, &memory.collider_b}) expect_hashed(state, *integer);
  for (Vector3* vector :
       {&memory.arm_a, &memory.arm_b, &memory.displacement, &memory.force, &memory.stiffness})
    expect_hashed(state, *vector);
  expect_hashed(state, memory.left_over);
  expect_hashed(state, memory.slides);
}

TEST(StateHash, CoversEveryNumberOfPatches) {
  Simulation simulation(scene_named("box_stack"), default_settings(Algorithm::a5));
  simulation.step();
  State state = simulation.state();
  ASSERT_FALSE(state.patches.empty());
  PatchShape& patch = state.patches[0];
  for (int* integer : {&patch.a, &patch.b, &patch.collider_a, &patch.collider_b, &patch.corners})
    expect_hashed(state, *integer);
  for (Vector3* vector : {&patch.arm_a, &patch.arm_b, &patch.position}) expect_hashed(state, *vector);
  for (Matrix3* matrix : {&patch.axes_in_a, &patch.axes_in_b})
    expect_hashed(state, std::span(matrix->data(), 9));
  for (double* number : {&patch.friction, &patch.radius, &patch.left_over, &patch.margin})
    expect_hashed(state, *number);
  expect_hashed(state, patch.left);
  expect_hashed(state, patch.force);
  expect_hashed(state, patch.reference);
  expect_hashed(state, patch.tilt);
  expect_hashed(state, std::span(patch.corner).first(4));
  expect_hashed(state, patch.slid);
}

TEST(ContactCache, KeepsRestingBoxInPlace) {
  double first = 0;
  for (const double heading : {0.0, 0.6, 2.1}) {
    for (const double turned : {0.0, 0.4, 1.1}) {
      for (const double mass : {0.03, 2.0, 700.0}) {
        Scene scene = test::floor_scene(0.6);
        const Quaternion slope =
            compose(rotation_quaternion({0, heading, 0}), rotation_quaternion({0, 0, std::numbers::pi / 9}));
        scene.colliders[0].placement.orientation = slope;
        const Pose pose{slope * Vector3(0.2, 0.1, 0), slope * rotation_quaternion({0, turned, 0})};
        test::add_box(scene, {0.5, 0.2, 0.3}, mass, pose, 0.6);
        for (const Algorithm algorithm : test::iterative_algorithms) {
          Simulation simulation(scene, default_settings(algorithm));
          for (int i = 0; i < 30; ++i) simulation.step();
          const Vector3 settled = simulation.state().q[1].linear;
          first = std::max(first, (settled - pose.position).norm());
          for (int i = 0; i < 120; ++i) EXPECT_NE(simulation.step().status, StepReport::Status::diverged);
          const double crept = (simulation.state().q[1].linear - settled).norm();
          // In two seconds; measured 2.5e-14.
          EXPECT_LT(crept, 2e-6) << name(algorithm) << ", heading " << heading << ", turned " << turned
                                 << ", mass " << mass;
        }
      }
    }
  }
  EXPECT_LT(first, 2e-5);  // measured 1.3e-5 m, in the first steps
}

}  // namespace
}  // namespace substep
