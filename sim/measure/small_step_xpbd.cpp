/// Small-step position-based dynamics without compliance: Macklin, Storey, Lu, Terdiman, Chentanez, Jeschke,
/// Müller, "Small Steps in Physics Simulation" (2019), algorithm 1, with the rigid bodies of Müller, Macklin,
/// Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics" (2020).
///
/// For chains on ball joints in the plane z = 0, to compare A3 with. It shares no code with the solver.

#include <cmath>

#include "sim/error.h"
#include "sim/math/rotation.h"
#include "sim/measure/claims_measurement.h"

namespace substep::claims {
namespace {

class PlanarXpbd {
 public:
  /// Throws Error where a body's position or orientation is not in the plane.
  explicit PlanarXpbd(const Scene& scene) : gravity_(scene.gravity.y()) {
    for (const Body& body : scene.bodies) {
      const Vector3 turn = rotation_vector(body.pose.orientation);
      if (turn.x() != 0 || turn.y() != 0 || body.pose.position.z() != 0)
        throw Error("body {}: is not in the plane z = 0", body.name);
      bodies_.push_back({body.inverse_mass,
                         body.inverse_inertia.z(),
                         {body.pose.position.x(), body.pose.position.y(), turn.z()},
                         {body.linear_velocity.x(), body.linear_velocity.y(), body.angular_velocity.z()},
                         Vector3::Zero()});
    }
    for (const Joint& joint : scene.joints) {
      joints_.push_back(
          {joint.body_a, joint.body_b, joint.frame_a.position.head<2>(), joint.frame_b.position.head<2>()});
    }
  }

  void substep(double h, int iterations) {
    for (PlanarBody& body : bodies_) {
      if (body.inverse_mass > 0) body.velocity.y() += h * gravity_;
      body.before = body.p;
      body.p += h * body.velocity;
    }
    for (int i = 0; i < iterations; ++i) {
      for (const PlanarJoint& joint : joints_) project(joint);
    }
    for (PlanarBody& body : bodies_) body.velocity = (body.p - body.before) / h;
  }

  /// Returns a body's centre, m.
  Vector3 centre(std::size_t body) const { return {bodies_[body].p.x(), bodies_[body].p.y(), 0}; }

 private:
  struct PlanarBody {
    double inverse_mass;
    double inverse_inertia;
    Vector3 p;         // x and y of the centre in m, and the angle in rad
    Vector3 velocity;  // m/s, m/s, rad/s
    Vector3 before;    // p at the sub-step's start

    /// Returns a point of the body's frame from its centre, in the world.
    Vector2 arm(const Vector2& point) const {
      const auto [sine, cosine] = sine_cosine(p[2]);
      return {cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]};
    }

    /// Returns M⁻¹ of an impulse (x, y) at `arm`.
    Vector3 response(const Vector2& arm, double x, double y) const {
      return {inverse_mass * x, inverse_mass * y, inverse_inertia * (arm[0] * y - arm[1] * x)};
    }
  };
  struct PlanarJoint {
    int a;
    int b;
    Vector2 at_a;  // in the bodies' frames, m
    Vector2 at_b;
  };

  /// Closes a joint: C = p_a + r_a − p_b − r_b is taken to zero with one 2 × 2 system.
  void project(const PlanarJoint& joint) {
    PlanarBody& a = bodies_[joint.a];
    PlanarBody& b = bodies_[joint.b];
    const Vector2 ra = a.arm(joint.at_a);
    const Vector2 rb = b.arm(joint.at_b);
    const double cx = a.p[0] + ra[0] - b.p[0] - rb[0];
    const double cy = a.p[1] + ra[1] - b.p[1] - rb[1];
    const double w = a.inverse_mass + b.inverse_mass;
    const double xx = w + a.inverse_inertia * ra[1] * ra[1] + b.inverse_inertia * rb[1] * rb[1];
    const double yy = w + a.inverse_inertia * ra[0] * ra[0] + b.inverse_inertia * rb[0] * rb[0];
    const double xy = -a.inverse_inertia * ra[0] * ra[1] - b.inverse_inertia * rb[0] * rb[1];
    const double determinant = xx * yy - xy * xy;
    const double px = -(yy * cx - xy * cy) / determinant;
    const double py = -(xx * cy - xy * cx) / determinant;
    a.p += a.response(ra, px, py);
    b.p -= b.response(rb, px, py);
  }

  std::vector<PlanarBody> bodies_;
  std::vector<PlanarJoint> joints_;
  double gravity_;
};

}  // namespace

double distance_from_xpbd(const Scene& scene, const Settings& settings, double duration) {
  Simulation simulation(scene, settings);
  PlanarXpbd xpbd(scene);
  double most = 0;
  for (int k = 0; k < static_cast<int>(std::lround(duration / settings.step)); ++k) {
    if (simulation.step().status == StepReport::Status::diverged) return infinity;
    for (int j = 0; j < settings.substeps; ++j)
      xpbd.substep(settings.step / settings.substeps, settings.iterations);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const double distance = (simulation.state().q[i].linear - xpbd.centre(i)).norm();
      if (!(distance <= most)) most = std::isfinite(distance) ? distance : infinity;
    }
  }
  return most;
}

}  // namespace substep::claims
