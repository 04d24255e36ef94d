// A3 with 'stable' joints at τ = κ = 1 is small-step position-based dynamics without compliance: Macklin,
// Storey, Lu, Terdiman, Chentanez, Jeschke, Müller, "Small Steps in Physics Simulation" (2019), algorithm 1,
// with the rigid bodies of Müller, Macklin, Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with
// Extended Position Based Dynamics" (2020). Here is one written from these papers, for chains that swing in
// the plane z = 0; it shares no line with the solver.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "sim/loading/load_scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

struct PlanarBody {
  double inverse_mass, inverse_inertia;
  std::array<double, 3> p;         // x, y, angle
  std::array<double, 3> velocity;  // m/s, m/s, rad/s
  std::array<double, 3> before;    // p at the sub-step's start
};

struct PlanarJoint {
  int a, b;
  std::array<double, 2> at_a, at_b;  // in the bodies' frames, m
};

class PlanarXpbd {
 public:
  explicit PlanarXpbd(const Scene& scene) : gravity_(scene.gravity.y()) {
    for (const Body& body : scene.bodies) {
      const Quaternion& turn = body.pose.orientation;
      EXPECT_EQ(turn.x(), 0) << body.name;
      EXPECT_EQ(turn.y(), 0) << body.name;
      EXPECT_EQ(body.pose.position.z(), 0) << body.name;
      bodies.push_back({body.inverse_mass,
                        body.inverse_inertia.z(),
                        {body.pose.position.x(), body.pose.position.y(), 2 * std::atan2(turn.z(), turn.w())},
                        {body.linear_velocity.x(), body.linear_velocity.y(), body.angular_velocity.z()},
                        {}});
    }
    for (const Joint& joint : scene.joints) {
      const Vector3& a = joint.frame_a.position;
      const Vector3& b = joint.frame_b.position;
      joints_.push_back({joint.body_a, joint.body_b, {a.x(), a.y()}, {b.x(), b.y()}});
    }
  }

  void substep(double h, int iterations) {
    for (PlanarBody& body : bodies) {
      if (body.inverse_mass > 0) body.velocity[1] += h * gravity_;
      body.before = body.p;
      for (int k = 0; k < 3; ++k) body.p[k] += h * body.velocity[k];
    }
    for (int i = 0; i < iterations; ++i) {
      for (const PlanarJoint& joint : joints_) project(joint);
    }
    for (PlanarBody& body : bodies) {
      for (int k = 0; k < 3; ++k) body.velocity[k] = (body.p[k] - body.before[k]) / h;
    }
  }

  std::vector<PlanarBody> bodies;

 private:
  static std::array<double, 2> turned(const std::array<double, 2>& arm, double angle) {
    return {std::cos(angle) * arm[0] - std::sin(angle) * arm[1],
            std::sin(angle) * arm[0] + std::cos(angle) * arm[1]};
  }

  /// Closes a joint: C = p_a + r_a − p_b − r_b is taken to zero with one 2 × 2 system.
  void project(const PlanarJoint& joint) {
    PlanarBody& a = bodies[joint.a];
    PlanarBody& b = bodies[joint.b];
    const std::array<double, 2> ra = turned(joint.at_a, a.p[2]);
    const std::array<double, 2> rb = turned(joint.at_b, b.p[2]);
    const double cx = a.p[0] + ra[0] - b.p[0] - rb[0];
    const double cy = a.p[1] + ra[1] - b.p[1] - rb[1];
    const double w = a.inverse_mass + b.inverse_mass;
    const double xx = w + a.inverse_inertia * ra[1] * ra[1] + b.inverse_inertia * rb[1] * rb[1];
    const double yy = w + a.inverse_inertia * ra[0] * ra[0] + b.inverse_inertia * rb[0] * rb[0];
    const double xy = -a.inverse_inertia * ra[0] * ra[1] - b.inverse_inertia * rb[0] * rb[1];
    const double determinant = xx * yy - xy * xy;
    const double px = -(yy * cx - xy * cy) / determinant;
    const double py = -(xx * cy - xy * cx) / determinant;
    a.p[0] += a.inverse_mass * px;
    a.p[1] += a.inverse_mass * py;
    a.p[2] += a.inverse_inertia * (ra[0] * py - ra[1] * px);
    b.p[0] -= b.inverse_mass * px;
    b.p[1] -= b.inverse_mass * py;
    b.p[2] -= b.inverse_inertia * (rb[0] * py - rb[1] * px);
  }

  std::vector<PlanarJoint> joints_;
  double gravity_;
};

/// Largest distance of a body's centre between the two, over `duration`, m.
double farthest(const std::string& name, int n, int m, double step, double duration) {
  const Scene scene = load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/" + name + ".gltf");
  Settings settings = default_settings(Algorithm::a3);
  settings.step = step;
  settings.substeps = n;
  settings.iterations = m;
  settings.tau = 1;
  settings.kappa = 1;
  settings.joints = Joints::stable;
  Simulation simulation(scene, settings);
  PlanarXpbd xpbd(scene);
  double most = 0;
  for (int k = 0; k < static_cast<int>(std::lround(duration / step)); ++k) {
    simulation.step();
    for (int j = 0; j < n; ++j) xpbd.substep(step / n, m);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const Vector3 other(xpbd.bodies[i].p[0], xpbd.bodies[i].p[1], 0);
      most = std::max(most, (simulation.state().q[i].linear - other).norm());
    }
  }
  return most;
}

TEST(SmallStepXpbd, IsA3WithStableJointsOnChains) {
  // Measured: 2.5e-12, 3.1e-12, 2.4e-12 and 1.0e-12 m, rounding that the motion amplifies.
  EXPECT_LT(farthest("rod_chain", 4, 1, 1.0 / 60, 2), 1e-11);
  EXPECT_LT(farthest("rod_chain", 3, 2, 1.0 / 97, 2), 1e-11);
  EXPECT_LT(farthest("heavy_chain", 16, 1, 1.0 / 60, 2), 1e-11);
  EXPECT_LT(farthest("heavy_chain", 5, 3, 1.0 / 60, 2), 1e-11);
}

TEST(SmallStepXpbd, IsNotA3WithPlainJointsOrAnotherTau) {
  const Scene scene = load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/rod_chain.gltf");
  for (const bool plain : {true, false}) {
    Settings settings = default_settings(Algorithm::a3);
    settings.step = scene.step;
    settings.substeps = 4;
    settings.tau = plain ? 1 : 0.9;
    settings.joints = plain ? Joints::plain : Joints::stable;
    Simulation simulation(scene, settings);
    PlanarXpbd xpbd(scene);
    for (int k = 0; k < 60; ++k) {
      simulation.step();
      for (int j = 0; j < 4; ++j) xpbd.substep(scene.step / 4, 1);
    }
    EXPECT_GT(std::abs(simulation.state().q[1].linear.x() - xpbd.bodies[1].p[0]), 1e-5) << plain;
  }
}

}  // namespace
}  // namespace substep
