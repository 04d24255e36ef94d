// Claim 5 (IV.4) of the report, A5 is A4 refactored, for contacts. `substep report claims` measures the rest.

#include <gtest/gtest.h>

#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using test::run;

Settings settings_of_a4() {
  Settings settings = test::sub_stepped(Algorithm::a4, 4, 0.6, 0.9, Joints::plain);
  settings.iterations = 2;
  return settings;
}

TEST(Claim5, HoldsForOneSidedAndLimitedRowsToo) {
  Scene scene = test::floor_scene(0.4);
  test::add_box(scene, {1, 1, 1}, 1, {{0, 0.6, 0}, rotation_quaternion({0.1, 0.2, 0.05})}, 0.4);
  scene.bodies[1].linear_velocity = {1, 0, 0.3};
  Settings a4 = settings_of_a4();
  Settings a5 = a4;
  a5.algorithm = Algorithm::a5;
  // Contacts amplify rounding by each new contact set, so the time is short: 20 steps, 4 of them with
  // contact.
  const State one = run(scene, a4, 20 * a4.step);
  const State other = run(scene, a5, 20 * a5.step);
  EXPECT_LT(position_difference(one, other), 1e-11);
}

// A joint beside contacts: A5's sum of velocities follows the joint's τ and κ, contacts take their own share.
TEST(Claim5, HoldsWhereContactsHaveTheirOwnStabilization) {
  const Scene scene = scene_named("powered_wheel");
  Settings a4 = settings_of_a4();
  a4.contact_tau = 1.1;
  a4.contact_kappa = 0.7;
  Settings a5 = a4;
  a5.algorithm = Algorithm::a5;
  const State one = run(scene, a4, 0.25);
  EXPECT_LT(position_difference(one, run(scene, a5, 0.25)), 1e-11);
  Settings all = a5;
  all.contact_tau = all.contact_kappa = 0;
  EXPECT_GT(position_difference(one, run(scene, all, 0.25)), 1e-6);
}

}  // namespace
}  // namespace substep
