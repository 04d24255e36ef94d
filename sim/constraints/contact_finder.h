#pragma once
/// s1, geometry: the contacts of a step.

#include <span>
#include <utility>
#include <vector>

#include "sim/geometry/contact.h"
#include "sim/model/model.h"
#include "sim/model/state.h"

namespace substep {

/// Finds the contacts of a step. Keeps its arrays from step to step, not its answers.
class ContactFinder {
 public:
  ContactFinder(const Scene& scene, const Model& model);

  /// The overlap that bodies meet with, at the start above all, is recovered at this speed, m/s: the rest of
  /// it is left to later steps (Contact::left_over). Else they would leave each other with C/h. What they
  /// sink into each other afterwards, for want of sweeps, is not spared.
  static constexpr double recovery_speed = 0.4;

  /// Contact points closer than the bodies can come in `step` seconds, at world velocities `v`; friction and
  /// overlaps as the state remembers them. With `aligned`, the first tangent is along the slip velocity that
  /// gravity leaves, where there is any; else it depends on the normal alone.
  const std::vector<Contact>& find(const State& state, double step, bool aligned = false);

 private:
  struct Candidate {
    const Collider* collider;
    double reach;  ///< of the shape's farthest point from the body's origin
    double size;   ///< of the shape; infinite for planes
    bool curved;   ///< not flat everywhere
  };
  bool may_meet(std::uint32_t i, std::uint32_t j) const;
  void add_contacts(const State& state, double step, bool aligned, std::uint32_t a, std::uint32_t b);
  void set_rolling(const ContactPoint& point, Contact& contact) const;
  void list_remembered(const State& state);
  std::span<const ContactMemory> remembered_of(const State& state, std::uint32_t a, std::uint32_t b) const;
  void remember(std::span<const ContactMemory> remembered, double step, double overlap, double slip,
                Contact& contact) const;

  const Model& model_;
  std::vector<Candidate> candidates_;
  std::vector<Pose> poses_;
  std::vector<Bounds> bounds_;
  std::vector<double> margins_;
  BroadPhase broad_phase_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
  std::vector<int> begins_;  ///< by collider: of what is remembered
  std::vector<ContactPoint> points_;
  std::vector<Contact> contacts_;
};

}  // namespace substep
