#pragma once
/// Measures of a run that must stay zero or constant, without a reference: energy, momentum, gaps of joints,
/// overlaps.

#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/measure/passage_meter.h"
#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

struct Metrics;

/// Returns the kinetic and potential energy of all finite masses and moments of inertia, J.
double energy(const Scene& scene, const State& state);

/// Returns the kinetic energy at the start plus the energy of a fall by the scene's size, J.
double energy_scale(const Scene& scene);

struct Momentum {
  Vector3 linear = Vector3::Zero();   ///< N·s
  Vector3 angular = Vector3::Zero();  ///< about the common centre of mass, N·m·s
};

/// Returns the momentum of all bodies of finite mass, less the momentum that gravity adds in the `time`
/// seconds since the start.
Momentum momentum(const Scene& scene, const State& state, double time);

/// Returns true where all rows belong to hard joints, which neither store nor take energy: there are no
/// contacts, drives, springs or stops.
bool is_rigid(const Model& model);

/// Returns the largest distance of a body's centre from its start, m.
double moved(const Scene& scene, const State& start, const State& state);

/// Measures the gaps of a scene's joints: the violation of a locked direction, a locked angle or a hard
/// limit. Lengths count in m, angles in rad times a lever, the smaller of the largest radii of gyration of
/// the joint's moving bodies about the joint. So an angle counts by the distance that it moves the lighter
/// end's mass.
class JointGapMeter {
 public:
  explicit JointGapMeter(const Scene& scene);

  /// Returns true where no joint has a hard limit.
  bool is_empty() const { return held_.empty(); }
  /// Returns the largest gap, m.
  double gap(const State& state) const;

 private:
  struct Held {
    Attachment at;
    JointCoordinate coordinate;
    double low;
    double high;
    double scale;  ///< 1, or an angle's lever, m
  };
  std::vector<Held> held_;
};

/// Measures the deepest overlap of two colliders that can meet, m.
class PenetrationMeter {
 public:
  explicit PenetrationMeter(const Scene& scene) : model_(build_model(scene)), finder_(scene, model_) {}
  PenetrationMeter(const PenetrationMeter&) = delete;
  PenetrationMeter& operator=(const PenetrationMeter&) = delete;
  double depth(const State& state);
  /// Returns the deepest overlap of each body's colliders, by body.
  std::vector<double> depths(const State& state);

 private:
  Model model_;
  ContactFinder finder_;
};

/// Gathers `joint_gap`, `penetration`, `energy_change`, `energy_growth`, `moved` and the momenta of Metrics
/// along a run.
class Invariants {
 public:
  Invariants(const Scene& scene, const State& start);  ///< the scene must outlive it
  void add(const State& state, double time, Metrics& metrics);
  /// Gathers `passages` and `summed_turn`, for which it needs the state after each step of `step` seconds.
  void follow(const State& state, double step, Metrics& metrics);

 private:
  const Scene& scene_;
  PenetrationMeter meter_;
  JointGapMeter joints_;
  PassageMeter passage_;
  bool is_free_;
  State start_;
  std::vector<Vector3> local_spins_;   ///< after the last step, rad/s, by body
  std::vector<Vector3> summed_turns_;  ///< so far, in the world, rad, by body
  double energy_;
  Momentum momentum_;
};

}  // namespace substep
