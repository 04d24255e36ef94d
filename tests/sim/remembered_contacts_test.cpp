// The contact cache is part of the state.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <tuple>
#include <utility>

#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr Algorithm iterative[] = {Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

std::uint64_t hash_after(Simulation& simulation, int steps) {
  for (int i = 0; i < steps; ++i) simulation.step();
  return hash(simulation.state());
}

TEST(RememberedContacts, StateContinuesTheRun) {
  for (const char* name : {"box_stack", "card_house", "dominoes", "incline"}) {
    const Scene scene = scene_named(name);
    for (const Algorithm algorithm : iterative) {
      const Settings settings = default_settings(algorithm);
      Simulation whole(scene, settings);
      hash_after(whole, 60);
      const State middle = whole.state();
      ASSERT_FALSE(middle.patches.empty()) << name;
      Simulation rest(scene, settings);
      rest.set_state(middle);
      const std::uint64_t expected = hash_after(whole, 60);
      EXPECT_EQ(hash_after(rest, 60), expected) << name << ' ' << substep::name(algorithm);

      State forgetful = middle;
      forgetful.contacts.clear();
      forgetful.patches.clear();
      Simulation other(scene, settings);
      other.set_state(forgetful);
      EXPECT_NE(hash_after(other, 60), expected) << name << ' ' << substep::name(algorithm);
    }
  }
}

TEST(RememberedContacts, AreSortedByColliderAndPosition) {
  for (const char* name : {"stone_pyramid", "dominoes", "funnel", "wrecking_ball"}) {
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
    // Measured 25, 27, 350 and 53: the order says something.
    EXPECT_GT(simulation.state().contacts.size() + simulation.state().patches.size(), 20U) << name;
  }
}

TEST(RememberedContacts, HashCoversEveryNumber) {
  State state = initial_state(test::floor_scene(0.6));
  const std::uint64_t without = hash(state);
  state.contacts.push_back({3, 5, {0.1, 0.2, 0.3}, {-0.4, 0.5, 0.6}, {1e-5, 2e-5, -3e-5}, false, 0.01});
  const std::uint64_t before = hash(state);
  EXPECT_NE(before, without);
  using Change = std::function<void(ContactMemory&)>;
  std::vector<std::pair<std::string, Change>> changes{
      {"collider_a", [](ContactMemory& m) { m.collider_a = 4; }},
      {"collider_b", [](ContactMemory& m) { m.collider_b = 4; }},
      {"slides", [](ContactMemory& m) { m.slides = true; }},
      {"left_over", [](ContactMemory& m) { m.left_over = std::nextafter(m.left_over, 1); }}};
  for (int k = 0; k < 3; ++k) {
    const auto add = [&](const char* field, Vector3 ContactMemory::*member) {
      changes.emplace_back(
          field, [k, member](ContactMemory& m) { (m.*member)[k] = std::nextafter((m.*member)[k], 1); });
    };
    add("arm_a", &ContactMemory::arm_a);
    add("arm_b", &ContactMemory::arm_b);
    add("displacement", &ContactMemory::displacement);
  }
  for (const auto& [field, change] : changes) {
    State changed = state;
    change(changed.contacts[0]);
    EXPECT_NE(hash(changed), before) << field;
  }
}

TEST(StateHash, CoversEveryNumberOfPatches) {
  Simulation simulation(scene_named("box_stack"), default_settings(Algorithm::a5));
  simulation.step();
  const State state = simulation.state();
  ASSERT_FALSE(state.patches.empty());
  const std::uint64_t before = hash(state);
  const auto changes_hash = [&](const std::function<void(PatchShape&)>& change) {
    State changed = state;
    change(changed.patches[0]);
    return hash(changed) != before;
  };
  const auto next = [](double& x) { x = std::nextafter(x, x + 1); };
  for (int PatchShape::*member : {&PatchShape::a, &PatchShape::b, &PatchShape::collider_a,
                                  &PatchShape::collider_b, &PatchShape::corners}) {
    EXPECT_TRUE(changes_hash([&](PatchShape& patch) { --(patch.*member); }));
  }
  EXPECT_TRUE(changes_hash([](PatchShape& patch) { patch.slid = !patch.slid; }));
  for (double PatchShape::*member :
       {&PatchShape::friction, &PatchShape::radius, &PatchShape::left_over, &PatchShape::margin}) {
    EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.*member); }));
  }
  for (Vector3 PatchShape::*member : {&PatchShape::arm_a, &PatchShape::arm_b, &PatchShape::position}) {
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next((patch.*member)[k]); }));
  }
  for (Matrix3 PatchShape::*member : {&PatchShape::axes_in_a, &PatchShape::axes_in_b}) {
    for (int k = 0; k < 9; ++k) {
      EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next((patch.*member).data()[k]); }));
    }
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.left[k]); }));
    EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.reference[k]); }));
  }
  for (int k = 0; k < 4; ++k) {
    EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.corner[k][k % 2]); }));
  }
  EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.tilt[0]); }));
  EXPECT_TRUE(changes_hash([&](PatchShape& patch) { next(patch.tilt[1]); }));
}

TEST(RememberedContacts, BoxAtRestDoesNotCreep) {
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
        for (const Algorithm algorithm : iterative) {
          Simulation simulation(scene, default_settings(algorithm));
          for (int i = 0; i < 30; ++i) simulation.step();
          const Vector3 settled = simulation.state().q[1].linear;
          first = std::max(first, (settled - pose.position).norm());
          for (int i = 0; i < 120; ++i) simulation.step();
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
