#pragma once
/// An engine that steps one of the benchmark's scenes: ours or a peer.

#include <memory>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/settings.h"

namespace substep::benchmark {

class Contestant {
 public:
  virtual ~Contestant() = default;
  virtual void step() = 0;
  virtual Vector3 position(int body) const = 0;  ///< of the centre of mass, world; body >= 1
};

std::unique_ptr<Contestant> make_ours(const Scene& scene, const Settings& settings);

/// Peers get bodies, boxes, planes and ball joints; that is what the scenes have. Their settings are their
/// defaults except where a parameter says otherwise; bodies never sleep.
/// ODE: dWorldStep for 0 iterations, else QuickStep.
std::unique_ptr<Contestant> make_ode(const Scene& scene, double step, int iterations);
/// Bullet's sequential impulses, warm starting and split impulse as it ships them.
std::unique_ptr<Contestant> make_bullet(const Scene& scene, double step, int iterations);

}  // namespace substep::benchmark
