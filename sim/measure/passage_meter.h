#pragma once
/// Detects bodies that pass through others.

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

/// Detects bodies that pass through others within a step, so that no state shows it. The middle of a collider
/// passes through another collider if its path in the other's frame
/// - leaves a convex solid by a side that faces away from the side of entry;
/// - comes within half the radius of the axis of a ball or capsule;
/// - ends behind the front of a triangle mesh, or crosses a two-sided one.
/// Within a step each body moves straight with its old velocity and then with its new one, and turns evenly.
/// A body below a plane counts as penetration. The meter ignores colliders that move in a step by less than
/// the radius of a ball that fits into them, and bodies that turn by more than 2.5 rad.
class PassageMeter {
 public:
  PassageMeter(const Scene& scene, const State& start);  ///< the scene must outlive it

  /// Adds the state after another `step` seconds.
  void add(const State& state, double step);

  /// Returns the pairs of bodies of which one passed through the other.
  const std::set<std::pair<int, int>>& passages() const { return passages_; }

 private:
  /// A collider that others may pass through.
  struct Obstacle {
    std::optional<Polytope> facets;  ///< of a polytope, or of a cylinder
    Vector3 middle;                  ///< body frame
    double inner;  ///< radius of a ball within (of cones: roughly), m; infinite for planes and meshes
    double reach;  ///< distance of its farthest point from the body's centre of mass, m
  };
  /// The motion of a body in a step.
  struct BodyMotion {
    Coordinates from;
    Coordinates to;
    Vector3 velocity_before;  ///< m/s, world
    Vector3 velocity_after;
    double step;    ///< s
    double bend;    ///< time at which the velocity changes, s
    Vector3 turn;   ///< rotation vector, frame of `from`
    double length;  ///< of the centre's path, m
    double spun;    ///< step × the larger of the two angular speeds, rad
    Pose at(double time) const;
  };
  /// Returns an upper bound of the length of the path of a collider's middle in another's frame, m.
  double longest_path(std::size_t point, std::size_t through) const;
  /// Returns true where the middle of collider `point` passes through collider `through` in the last step.
  bool passes(std::size_t point, std::size_t through) const;

  const Scene& scene_;
  Model model_;
  ContactFinder finder_;
  std::vector<Obstacle> obstacles_;  ///< by collider
  double thinnest_ = infinity;       ///< least inner radius of a collider, m
  std::vector<double> reaches_;      ///< by body, m
  State before_;
  std::vector<BodyMotion> motions_;
  BroadPhase broad_phase_;
  std::vector<Bounds> bounds_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
  std::set<std::pair<int, int>> passages_;
};

}  // namespace substep
