// A scene with lengths, masses and forces scaled by powers of two has the scaled motion, to the bit: no
// threshold of the solver has a unit.

#include <gtest/gtest.h>

#include "sim/model/model.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"
#include "tests/scene_files.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

struct Scale {
  double length;
  double mass;

  void apply(Pose& pose) const { pose.position *= length; }
  void apply(std::vector<Vector3>& points) const {
    for (Vector3& point : points) point *= length;
  }
  void apply(std::initializer_list<double*> lengths) const {
    for (double* value : lengths) *value *= length;
  }
  void operator()(Sphere& shape) const { apply({&shape.radius}); }
  void operator()(Capsule& shape) const { apply({&shape.half_length, &shape.radius}); }
  void operator()(Plane& /*shape*/) const {}
  void operator()(Polytope& shape) const {
    apply(shape.vertices);
    for (double& offset : shape.face_offsets) offset *= length;
    shape.centre *= length;
    apply({&shape.bounding_radius, &shape.inner_radius});
    if (shape.half_box) *shape.half_box *= length;
    if (shape.ellipsoid) *shape.ellipsoid *= length;
  }
  void operator()(Cylinder& shape) const {
    apply({&shape.half_height, &shape.radius_bottom, &shape.radius_top});
  }
  void operator()(TaperedCapsule& shape) const {
    apply({&shape.half_length, &shape.radius_bottom, &shape.radius_top});
  }
  void operator()(TriangleMesh& shape) const {
    apply(shape.vertices);
    for (TriangleMesh::Node& node : shape.nodes) {
      node.bounds.min() *= length;
      node.bounds.max() *= length;
    }
  }

  /// Return the factors of forces (N), and of stiffness (N/m) and damping, or of their angular counterparts.
  double of_force(bool angular) const { return angular ? mass * length * length : mass * length; }
  double of_stiffness(bool angular) const { return angular ? mass * length * length : mass; }

  void apply(Joint& joint) const {
    apply(joint.frame_a);
    apply(joint.frame_b);
    for (JointLimit& limit : joint.limits) {
      if (!limit.angular) apply({&limit.min, &limit.max});
      if (limit.stiffness) *limit.stiffness *= of_stiffness(limit.angular);
      limit.damping *= of_stiffness(limit.angular);
    }
    for (JointDrive& drive : joint.drives) {
      if (!drive.angular) apply({&drive.position_target, &drive.velocity_target});
      const bool is_per_mass = drive.acceleration;
      drive.max_force *= is_per_mass ? (drive.angular ? 1 : length) : of_force(drive.angular);
      drive.stiffness *= is_per_mass ? 1 : of_stiffness(drive.angular);
      drive.damping *= is_per_mass ? 1 : of_stiffness(drive.angular);
    }
  }

  Scene operator()(Scene scene) const {
    scene.gravity *= length;
    for (Body& body : scene.bodies) {
      body.inverse_mass /= mass;
      body.inverse_inertia /= mass * length * length;
      apply(body.body_from_node);
      apply(body.pose);
      body.linear_velocity *= length;
    }
    for (Collider& collider : scene.colliders) {
      apply(collider.placement);
      std::visit(*this, collider.shape);
    }
    for (Joint& joint : scene.joints) apply(joint);
    return scene;
  }
};

/// Returns the first of `steps` steps after which a pose of the scaled scene differs from the scene's, or −1.
int first_difference(const Scene& scene, const Scale& scale, Algorithm algorithm, int steps) {
  const Settings settings = usual_settings(scene, algorithm);
  Simulation one(scene, settings);
  Simulation other(scale(scene), settings);
  for (int step = 1; step <= steps; ++step) {
    if (one.step().status == StepReport::Status::diverged) return step;
    other.step();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const Coordinates& q = one.state().q[i];
      const Coordinates& r = other.state().q[i];
      if (scale.length * q.linear != r.linear || q.angular.coeffs() != r.angular.coeffs()) return step;
    }
  }
  return -1;
}

class ScaledScene : public testing::TestWithParam<const char*> {};

TEST_P(ScaledScene, ScalesMotionToTheBit) {
  const Scene scene = scene_named(GetParam());
  for (const Scale scale : {Scale{0x1p-10, 1}, Scale{0x1p10, 1}, Scale{1, 0x1p-10}, Scale{1, 0x1p10}}) {
    for (const Algorithm algorithm : test::all_algorithms) {
      EXPECT_EQ(first_difference(scene, scale, algorithm, 60), -1)
          << title_of(algorithm) << ", lengths × " << scale.length << ", masses × " << scale.mass;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Library, ScaledScene,
                         testing::Values("balls_on_tray", "bouncing_balls", "bowling", "box_stack", "cradle",
                                         "door", "funnel", "governor", "joint_kinds", "masonry_arch",
                                         "near_miss", "overlap", "ragdoll", "rattleback", "rod_chain",
                                         "seams", "struck", "turntable", "wrecking_ball"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Divergence, NamesBodyThatMoves) {
  Scene scene = test::empty_scene();
  scene.bodies.emplace_back();  // kinematic
  test::add_body(scene, 1, Vector3::Ones());
  State state = initial_state(scene);
  for (Velocity& v : state.v) v.linear.x() = infinity;
  const Model model = build_model(scene);
  int body = 0;
  EXPECT_FALSE(is_finite(state, &body, &model));
  EXPECT_EQ(body, 2);
}

}  // namespace
}  // namespace substep
