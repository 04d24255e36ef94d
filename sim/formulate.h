#pragma once
/// s1 and s2: contacts and constraint rows from coordinates; what the listings ask of 𝒞 while sub-stepping.

#include <vector>

#include "sim/block_order.h"
#include "sim/constraint.h"
#include "sim/geometry/contact.h"
#include "sim/mlcp.h"
#include "sim/model.h"
#include "sim/settings.h"

namespace substep {

/// The frame of the rows' angular parts and of angular velocities: the world's (J, v) or the bodies' (J̆, v̆).
enum class Frame { world, body };

/// s1, geometry: finds the contacts of a step. Keeps its arrays from step to step.
class ContactFinder {
 public:
  ContactFinder(const Scene& scene, const Model& model);

  /// Contact points closer than the bodies can come in `step` seconds, at world velocities `v`. Tangents: the
  /// first along the slip velocity that the external forces leave, where there is any; so a sliding body's
  /// friction points against its motion, and has Coulomb's magnitude.
  const std::vector<Contact>& find(const State& state, double step);

 private:
  struct Candidate {
    const Collider* collider;
    double reach;  ///< of the shape's farthest point from the body's origin
  };
  bool may_meet(std::uint32_t i, std::uint32_t j) const;

  const Model& model_;
  std::vector<Candidate> candidates_;
  std::vector<Pose> poses_;
  std::vector<Bounds> bounds_;
  std::vector<double> margins_;
  BroadPhase broad_phase_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
  std::vector<ContactPoint> points_;
  std::vector<Contact> contacts_;
};

/// The coordinates a sub-step starts from, as an algorithm knows them: exactly stepped (A3), or the frame's
/// start and the sum of velocities since (A4, A5).
struct Substeps {
  double duration = 0;              ///< hs
  bool bias_at_next_frame = false;  ///< A3: a stable block's bias is taken there too
  std::vector<Coordinates> stepped;
  std::vector<Velocity> offset;  ///< Σ v̆ since `stepped`; zero in A3
};

/// What stays the same while one scene is stepped, and the rows.
struct Problem {
  const Model* model = nullptr;
  const std::vector<Contact>* contacts = nullptr;
  Frame frame = Frame::body;
  bool batched = false;  ///< contacts are in c.contacts, not among c.blocks
  Constraints c;
  BlockOrder order;
  Substeps substeps;
  std::vector<Matrix3> rotations;  ///< of `formulate`'s coordinates
};

/// The list of blocks: joints first, then (unless batched) contacts, each normal before its friction, as far
/// as they share bodies; see block_order.h. `joints` says how joints are blocked.
void build_blocks(Problem& problem, Joints joints);

/// s2: J, β(hs) and M⁻¹Jᵀ of every row from coordinates q.
void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs);

/// J̆_x, and in A3 β_x, of a stable block from the coordinates that velocities `v_hat` lead to. Nothing for
/// other blocks. `sum_v`: what A5's velocities carry beyond v̂, else null.
void update_stable(Problem& problem, Block& x, const std::vector<Velocity>& v_hat,
                   const std::vector<Velocity>* sum_v = nullptr);

/// v ← v + ext over `duration`: gravity, and the gyroscopic term of bodies that have one (orientations from
/// q, for the world frame).
void add_external(const Model& model, const std::vector<Coordinates>& q, Frame frame, double duration,
                  std::vector<Velocity>& v);

/// Angular velocities from the world's frame to the bodies': ᵣv̆ = R⁻¹ ᵣv (III), and back.
void to_local(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);
void to_world(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);

/// ₜq ← ₜq + hs ₜv̆, ᵣq ← ᵣq ∘ R_q(hs ᵣv̆), with local angular velocities.
void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q);

/// β_x ← β_x − J̆ v̆ of every position-level row.
void update_biases(Constraints& c, const std::vector<Velocity>& v_local);

/// β□ = (τ/κ) β of every row.
void box_biases(Constraints& c, double kappa, double tau);

/// β_x ← β_x + J̆ change of every velocity-level row: undoes what A5's sum of velocities bakes into it.
void undo_update_rule(Constraints& c, const std::vector<Velocity>& change);

/// The whole step's problem for A1, from blocks of one row, formulated in the bodies' frames, and local
/// velocities that include ext.
void make_mlcp(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp);

/// v̆ ← v̆ + M̆⁻¹J̆ᵀλ, from the impulses M̆^(−1/2)J̆ᵀλ that A1's solver leaves by body.
void add_impulses(const Model& model, const std::vector<Vector6>& impulses, std::vector<Velocity>& v_local);

}  // namespace substep
