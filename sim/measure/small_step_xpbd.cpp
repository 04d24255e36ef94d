#include "sim/measure/small_step_xpbd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/simulation.h"

namespace substep {
namespace {

std::array<double, 2> turned(const std::array<double, 2>& arm, double angle) {
  const auto [sine, cosine] = sine_cosine(angle);
  return {cosine * arm[0] - sine * arm[1], sine * arm[0] + cosine * arm[1]};
}

}  // namespace

PlanarXpbd::PlanarXpbd(const Scene& scene) : gravity_(scene.gravity.y()) {
  for (const Body& body : scene.bodies) {
    const Vector3 turn = rotation_vector(body.pose.orientation);
    if (turn.x() != 0 || turn.y() != 0 || body.pose.position.z() != 0)
      throw Error(fmt::format("body {}: is not in the plane z = 0", body.name));
    bodies_.push_back({body.inverse_mass,
                       body.inverse_inertia.z(),
                       {body.pose.position.x(), body.pose.position.y(), turn.z()},
                       {body.linear_velocity.x(), body.linear_velocity.y(), body.angular_velocity.z()},
                       {}});
  }
  for (const Joint& joint : scene.joints) {
    const Vector3& a = joint.frame_a.position;
    const Vector3& b = joint.frame_b.position;
    joints_.push_back({joint.body_a, joint.body_b, {a.x(), a.y()}, {b.x(), b.y()}});
  }
}

void PlanarXpbd::substep(double h, int iterations) {
  for (PlanarBody& body : bodies_) {
    if (body.inverse_mass > 0) body.velocity[1] += h * gravity_;
    body.before = body.p;
    for (int k = 0; k < 3; ++k) body.p[k] += h * body.velocity[k];
  }
  for (int i = 0; i < iterations; ++i) {
    for (const PlanarJoint& joint : joints_) project(joint);
  }
  for (PlanarBody& body : bodies_) {
    for (int k = 0; k < 3; ++k) body.velocity[k] = (body.p[k] - body.before[k]) / h;
  }
}

/// Closes a joint: C = p_a + r_a − p_b − r_b is taken to zero with one 2 × 2 system.
void PlanarXpbd::project(const PlanarJoint& joint) {
  PlanarBody& a = bodies_[joint.a];
  PlanarBody& b = bodies_[joint.b];
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

double distance_from_xpbd(const Scene& scene, const Settings& settings, double duration) {
  Simulation simulation(scene, settings);
  PlanarXpbd xpbd(scene);
  double most = 0;
  for (int k = 0; k < static_cast<int>(std::lround(duration / settings.step)); ++k) {
    simulation.step();
    for (int j = 0; j < settings.substeps; ++j)
      xpbd.substep(settings.step / settings.substeps, settings.iterations);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const Vector3 other(xpbd.position(i)[0], xpbd.position(i)[1], 0);
      most = std::max(most, (simulation.state().q[i].linear - other).norm());
    }
  }
  return most;
}

}  // namespace substep
