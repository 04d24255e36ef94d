// Manifolds in batches of four: lanes are independent.

#include "sim/constraints/contact_batch.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/measure/claims_measurement.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

constexpr int boxes_in_stack = 3;

/// Lets the last collider meet only the floor and colliders of the same group.
void put_in_group(Scene& scene, int group) {
  Collider& collider = scene.colliders.back();
  collider.in_no_system = false;
  collider.member = collider.collides_with = std::uint64_t{1} << group;
}

/// Adds three boxes, one on another, each with another orientation, a little above the floor.
void add_stack(Scene& scene, int copy, double push) {
  for (int i = 0; i < boxes_in_stack; ++i) {
    const Quaternion turned = rotation_quaternion({0.03 * i - 0.02, 0.4 * i, 0.05 - 0.04 * i});
    const int body =
        test::add_box(scene, {0.5, 0.3, 0.4}, 1.7 + i, {{0.02 * i, 0.18 + 0.33 * i, 0.01}, turned}, 0.5);
    scene.bodies[body].linear_velocity = {push, -0.1, 0.2 - 0.1 * i};
    scene.bodies[body].angular_velocity = {0.2, push, -0.1};
    put_in_group(scene, copy);
  }
}

/// Adds a box, a capsule on its side or a cylinder on the floor: each has another number of contacts.
void add_solid(Scene& scene, int kind) {
  const Quaternion turned = rotation_quaternion({0.01, 0.3 + 0.2 * kind, -0.02});
  const int body = test::add_box(scene, {0.6, 0.4, 0.5}, 1.3, {{0, 0.21, 0}, turned}, 0.5);
  scene.bodies[body].linear_velocity = {0.4, -0.1, 0.2};
  Collider& collider = scene.colliders.back();
  if (kind == 1) {
    collider.shape = Capsule{0.3, 0.2};
    collider.placement.orientation = rotation_quaternion({0, 0, 0.5 * std::numbers::pi});
  } else if (kind == 2) {
    collider.shape = Cylinder{0.2, 0.25, 0.25};
  }
  put_in_group(scene, kind);
}

/// Groups of bodies in one scene, and each group in a scene of its own.
class Groups {
 public:
  template <typename AddGroup>
  Groups(int count, const Settings& settings, const AddGroup& add_group) : scene_(test::floor_scene(0.5)) {
    for (int group = 0; group < count; ++group) {
      add_group(scene_, group);
      Scene scene = test::floor_scene(0.5);
      add_group(scene, group);
      alone_.emplace_back(scene, settings);
    }
    together_ = std::make_unique<Simulation>(scene_, settings);
  }

  /// Steps all scenes. Returns true where the groups have the bits that they have alone.
  bool step() {
    together_->step();
    std::size_t body = 1;
    for (Simulation& one : alone_) {
      one.step();
      for (std::size_t i = 1; i < one.state().q.size(); ++i, ++body) {
        const Coordinates& q = state().q[body];
        const Coordinates& r = one.state().q[i];
        const Velocity& v = state().v[body];
        const Velocity& w = one.state().v[i];
        if (q.linear != r.linear || q.angular.coeffs() != r.angular.coeffs() || v.linear != w.linear ||
            v.angular != w.angular)
          return false;
      }
    }
    return true;
  }

  const Scene& scene() const { return scene_; }
  const State& state() const { return together_->state(); }

 private:
  Scene scene_;
  std::vector<Simulation> alone_;
  std::unique_ptr<Simulation> together_;
};

TEST(ContactBatches, StackAmongOthersKeepsItsBits) {
  for (const double difference : {0.0, 0.17}) {
    for (const Algorithm algorithm : test::iterative_algorithms) {
      Settings settings = default_settings(algorithm);
      settings.kappa = 0.9;
      settings.relaxation = 1.1;
      for (const int copies : {1, 2, 3, 4, 5}) {
        Groups stacks(copies, settings,
                      [&](Scene& scene, int copy) { add_stack(scene, copy, 0.3 + difference * copy); });
        for (int step = 1; step <= 90; ++step)
          ASSERT_TRUE(stacks.step()) << name(algorithm) << ", " << copies << " copies, step " << step;
        EXPECT_GT(position_difference(stacks.state(), initial_state(stacks.scene())), 0.05);
      }
    }
  }
}

TEST(ContactBatches, UnlikeManifoldsKeepTheirBits) {
  for (const Algorithm algorithm : test::iterative_algorithms) {
    const Settings settings = default_settings(algorithm);
    Groups solids(3, settings, add_solid);
    const Model model = build_model(solids.scene());
    ContactFinder finder(solids.scene(), model);
    ContactBatches contacts;
    int unlike = 0;
    for (int step = 1; step <= 90; ++step) {
      const std::vector<Contact>& found = finder.find(solids.state(), settings.step, 1);
      contacts.build(model, found, finder.kept_patches(), solids.state().q);
      for (const ContactBatch& x : contacts.batches) {
        const bool is_unlike =
            x.patch < 0 ? x.count[0] < x.contacts : contacts.shapes[x.shape[0]].corners < x.corners;
        if (x.manifolds > 1 && is_unlike) ++unlike;
      }
      ASSERT_TRUE(solids.step()) << name(algorithm) << ", step " << step;
    }
    EXPECT_GT(unlike, 30) << name(algorithm);
  }
}

TEST(ContactBatches, ManifoldsOfOneBatchShareNoMovingBody) {
  const Scene scene = scene_named("stone_pyramid");
  const Model model = build_model(scene);
  ContactFinder finder(scene, model);
  const std::vector<Contact>& found = finder.find(initial_state(scene), 1.0 / 60, 1);
  ContactBatches contacts;
  std::vector<PatchShape> none;
  contacts.build(model, found, none, initial_state(scene).q);
  int rows = 0;
  int manifolds = 0;
  for (const ContactBatch& x : contacts.batches) {
    for (int lane = 0; lane < x.manifolds; ++lane) {
      rows += x.patch >= 0 ? 6 : (x.has_friction ? 3 : 1) * x.count[lane];
    }
    manifolds += x.manifolds;
    for (int one = 0; one < x.manifolds; ++one) {
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
  EXPECT_LT(std::ssize(contacts.batches), manifolds);  // measured 20 and 25: a small heap has long chains
}

}  // namespace
}  // namespace substep
