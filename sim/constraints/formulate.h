#pragma once
/// s2: constraint rows from coordinates; what the listings ask of 𝒞 while sub-stepping.

#include <vector>

#include "sim/constraints/block_order.h"
#include "sim/constraints/constraint.h"
#include "sim/direct/mlcp.h"
#include "sim/model/model.h"
#include "sim/model/settings.h"

namespace substep {

/// The coordinates a sub-step starts from, as an algorithm knows them: exactly stepped (A3), or the frame's
/// start and the sum of velocities since (A4, A5).
struct Substeps {
  double duration = 0;              ///< hs
  int count = 1;                    ///< n
  double part = 1;                  ///< of the step, that the sub-steps are of
  bool bias_at_next_frame = false;  ///< A3: a stable block's bias is taken there too
  std::vector<Coordinates> stepped;
  std::vector<Velocity> offset;  ///< Σ v̆ since `stepped`; zero in A3
  std::vector<Velocity> change;  ///< A5: of sv in the sub-step
  /// Changes of angular velocity by the gyroscopic term, one for each of Model::gyroscopic, rad/s.
  std::vector<Vector3> gyroscopic_change;
};

/// Impulses that a (sub-)step of A2 to A5 starts from; not in the report.
struct WarmStart {
  double fraction = 0;     ///< of what the last one gave; 0: λ = 0
  double joint_scale = 1;  ///< by which the impulses of joints are smaller than A5's λ□: κ
  double contact_scale = 1;
};

/// Data of one scene that is stepped, and its rows.
struct Problem {
  const Model* model = nullptr;
  const std::vector<Contact>* contacts = nullptr;
  std::vector<PatchShape>* kept_patches = nullptr;  ///< those of the step before that hold; or null
  Constraints c;
  BlockOrder order;
  Substeps substeps;
  WarmStart warm_start;
  std::vector<Matrix3> rotations;  ///< of `formulate`'s coordinates
};

/// Lists the blocks in the order of block_order.h, and the contacts in theirs. `joints` says how joints
/// are blocked. `q`: the coordinates at which the contacts were found; without them no contacts are patches,
/// which A1 needs: it solves all points of all contacts.
void build_blocks(Problem& problem, Joints joints, const std::vector<Coordinates>& q = {});

/// Returns the value of a joint's coordinate, m or rad.
double value_of(const JointCoordinate& coordinate, const Attachment& at, const std::vector<Coordinates>& q);

/// Returns the energy of springs, J: of soft limits beyond their bounds, and drives off their targets as if
/// no force were too large for them. Those by mass are left out.
double energy_of_springs(const Model& model, const std::vector<Coordinates>& q);

/// s2: computes J, β(hs) and M⁻¹Jᵀ of every row from coordinates q.
void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs);

/// Recomputes J̆_x, and in A3 β_x, of a stable block from the coordinates that velocities `v_hat` lead to.
/// Does nothing to other blocks. `sum_v`: what A5's velocities carry beyond v̂, else null.
void update_stable(Problem& problem, Block& x, const std::vector<Velocity>& v_hat,
                   const std::vector<Velocity>* sum_v = nullptr);

/// Adds external forces, v̆ ← v̆ + ext over `duration`: gravity, and the gyroscopic term of bodies that have
/// one. With that term v̆ is the mean over `duration` of a free body, so that the coordinates stepped with it
/// are exact.
void add_external(Problem& problem, double duration, std::vector<Velocity>& v_local);

/// Carries angular momenta through a (sub-)step: v̆ ← M̆ (v̆ without the gyroscopic term), turned by `duration`
/// v̆, the velocity at the end of what add_external gave the mean of. A free body keeps energy and momentum.
void carry_momenta(const Problem& problem, double duration, std::vector<Velocity>& v_local);

/// Does the same to world velocities `v`, with which the coordinates were stepped to `q`.
void carry_momenta(const Problem& problem, double duration, const std::vector<Coordinates>& q,
                   std::vector<Velocity>& v);

/// Turns angular velocities from the world's frame to the bodies', ᵣv̆ = R⁻¹ ᵣv (III), and back.
void to_local(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);
void to_world(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);

/// Steps coordinates, ₜq ← ₜq + hs ₜv̆, ᵣq ← ᵣq ∘ R_q(hs ᵣv̆), with local angular velocities.
void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q);

/// Sets λ = 0 for a sub-step that starts with velocities `v`; the limits hold for the sum of the step's.
/// Contacts that meet in the sub-step bounce. `sum_v`: what A5 adds to the velocities, else null. With a warm
/// start λ is a fraction of what the last sub-step gave, and `v` has it.
void start_substep(Problem& problem, std::vector<Velocity>& v, const std::vector<Velocity>* sum_v = nullptr);

/// Returns how often a sub-step sweeps over the rows where the setting says m. An impact is given in one
/// sub-step, so that one takes as many sweeps as pass it on through joints and through rows of touching
/// bodies.
int sweeps_of(const Problem& problem, int m);

/// Updates biases, β_x ← β_x − J̆ v̆, of every position-level row. Friction that slides lets go: its β is 0.
void update_biases(Problem& problem, const std::vector<Velocity>& v_local);

/// Scales biases, β□ = (τ/κ) β, of every row that is stabilized; the others' fixed point is their own β.
void box_biases(Constraints& c, const Settings& settings);

/// Adds J̆ change to β_x as far as x does not follow the coordinates: undoes what A5's sum of velocities bakes
/// into it, or contacts with their own τ, κ by another share. The change is (τ/κ) v̆, which led to
/// `sum_v`. Friction that slides lets go.
void undo_update_rule(Problem& problem, const Settings& settings, const std::vector<Velocity>& v_local,
                      const std::vector<Velocity>& sum_v);

/// Makes the whole step's problem for A1, from blocks of one row, formulated in the bodies' frames, and local
/// velocities that include ext. Contacts come last, by points: a normal, then its two rows of friction.
void make_mlcp(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp);

/// Sets the rows' impulses from the solution of make_mlcp()'s problem.
void keep_impulses(const std::vector<double>& lambda, Constraints& c);

/// Applies v̆ ← v̆ + M̆⁻¹J̆ᵀλ, from the impulses M̆^(−1/2)J̆ᵀλ that A1's solver leaves by body.
void add_impulses(const Model& model, const std::vector<Vector6>& impulses, std::vector<Velocity>& v_local);

/// Appends the impulses of the contacts in the step that was solved last, with the bodies at `q`.
void append_contact_impulses(const Problem& problem, const std::vector<Coordinates>& q,
                             std::vector<ContactImpulse>& result);

}  // namespace substep
