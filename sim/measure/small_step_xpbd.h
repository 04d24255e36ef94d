#pragma once
/// Small-step position-based dynamics without compliance: Macklin, Storey, Lu, Terdiman, Chentanez, Jeschke,
/// Müller, "Small Steps in Physics Simulation" (2019), algorithm 1, with the rigid bodies of Müller, Macklin,
/// Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics" (2020).
///
/// Written from these papers, for chains on ball joints that swing in the plane z = 0, to compare A3 with: it
/// shares nothing with the solver.

#include <array>
#include <vector>

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

class PlanarXpbd {
 public:
  /// Throws Error where a body's position or orientation is not in the plane.
  explicit PlanarXpbd(const Scene& scene);

  void substep(double h, int iterations);

  /// Returns x and y of a body's centre in m, and its angle in rad.
  const std::array<double, 3>& position(std::size_t body) const { return bodies_[body].p; }

 private:
  struct PlanarBody {
    double inverse_mass, inverse_inertia;
    std::array<double, 3> p;
    std::array<double, 3> velocity;  // m/s, m/s, rad/s
    std::array<double, 3> before;    // p at the sub-step's start
  };
  struct PlanarJoint {
    int a, b;
    std::array<double, 2> at_a, at_b;  // in the bodies' frames, m
  };

  void project(const PlanarJoint& joint);

  std::vector<PlanarBody> bodies_;
  std::vector<PlanarJoint> joints_;
  double gravity_;
};

/// Returns the largest distance of a body's centre between this program and A3 with these settings, over
/// `duration`, m.
double distance_from_xpbd(const Scene& scene, const Settings& settings, double duration);

}  // namespace substep
