#pragma once
/// s2: computes constraint rows from coordinates, and updates them between sub-steps.

#include <vector>

#include "sim/constraints/constraint.h"
#include "sim/direct/mlcp.h"
#include "sim/model/model.h"
#include "sim/model/settings.h"

namespace substep {

/// Angular velocities of a body that turns freely in a (sub-)step, in its frame, rad/s.
struct FreeRotation {
  Vector3 start;
  Vector3 mean;
};

/// The coordinates that a sub-step starts from: exactly stepped ones (A3), or those of the frame's start and
/// the sum of velocities since then (A4, A5).
struct Substeps {
  double duration = 0;              ///< hs
  int count = 1;                    ///< n
  double part = 1;                  ///< fraction of the step that the sub-steps divide
  bool bias_at_next_frame = false;  ///< A3: a stable block's bias is from the next frame too
  std::vector<Coordinates> stepped;
  std::vector<Velocity> offset;              ///< Σ v̆ since `stepped`; zero in A3
  std::vector<Velocity> change;              ///< A5: change of sv in the sub-step
  std::vector<FreeRotation> free_rotations;  ///< one for each of Model::gyroscopic
};

/// The warm start of (sub-)steps of A2 to A5; the report has none.
struct WarmStart {
  double fraction = 0;     ///< the next (sub-)step starts from this fraction of the last impulses; 0: λ = 0
  double joint_scale = 1;  ///< factor of joints' impulses relative to A5's λ□: κ
  double contact_scale = 1;
};

/// The contacts of a problem that has none.
inline const std::vector<Contact> no_contacts;

/// Data of one scene that is stepped, and its rows.
struct Problem {
  const Model* model = nullptr;
  const std::vector<Contact>* contacts = &no_contacts;
  std::vector<PatchShape>* kept_patches = nullptr;  ///< patches of the last step that still hold; or null
  Constraints c;
  Substeps substeps;
  WarmStart warm_start;
  std::vector<Matrix3> rotations;  ///< at the coordinates of formulate()
};

/// Lists the blocks of joints, and the contacts without patches. `joints` selects the joints' blocks.
/// Successive blocks seldom share a moving body, since a block then waits for the velocities of the block
/// before it, which takes most of its time. Blocks that do share one keep the model's order, so a sweep
/// computes the same bits in both orders.
void build_blocks(Problem& problem, Joints joints);

/// Lists the contacts of a step, and takes over the kept patches. `q`: the coordinates at which the contacts
/// were found; without them, as in A1, which solves all contacts by points, no contacts become patches.
void build_contacts(Problem& problem, const std::vector<Coordinates>& q = {});

/// Returns the value of a joint's coordinate, m or rad.
double value_of(const JointCoordinate& coordinate, const Attachment& at, const std::vector<Coordinates>& q);

/// Returns the energy of springs, J: of soft limits beyond their bounds and of drives away from their
/// targets, as if no drive had a largest force. Drives in mode 'acceleration' do not count.
double energy_of_springs(const Model& model, const std::vector<Coordinates>& q);

/// s2: computes J, β(hs) and M⁻¹Jᵀ of every row from coordinates q.
void formulate(Problem& problem, const std::vector<Coordinates>& q, double hs);

/// Coordinates of a block's two bodies, with rotations as matrices too.
struct BlockCoordinates {
  const Coordinates& a;
  const Coordinates& b;
  const Matrix3& rotation_a;
  const Matrix3& rotation_b;
};

/// Computes J, β and M⁻¹Jᵀ of a block's rows.
void formulate_block(Problem& problem, Block& x, const BlockCoordinates& at, double hs);

/// Recomputes J̆_x, and in A3 β_x, of a stable block from the coordinates to which `v_hat` leads. Does
/// nothing to other blocks. `sum_v`: A5's sum of velocities, which `v_hat` includes, else null.
void update_stable(Problem& problem, Block& x, const std::vector<Velocity>& v_hat,
                   const std::vector<Velocity>* sum_v = nullptr);

/// Adds external forces, v̆ ← v̆ + ext over `duration`: gravity, and the gyroscopic term of bodies that have
/// one. With that term v̆ is the mean over `duration` of a free body, so that the coordinates stepped with it
/// are exact.
void add_external(Problem& problem, double duration, std::vector<Velocity>& v_local);

/// Forms the means of add_external() anew from the velocities after the impulses, so that a body that an
/// impact sets spinning turns as a free body does.
void renew_free_rotation(Problem& problem, double duration, std::vector<Velocity>& v_local);

/// Replaces the mean velocities of add_external() by those at the end of the (sub-)step: carries angular
/// momenta, without the gyroscopic term, through the rotation by `duration` v̆. A free body keeps energy and
/// momentum.
void carry_momenta(const Problem& problem, double duration, std::vector<Velocity>& v_local);

/// Carries momenta as above for world velocities `v`, with which the coordinates were stepped to `q`.
void carry_momenta(const Problem& problem, double duration, const std::vector<Coordinates>& q,
                   std::vector<Velocity>& v);

/// Turns angular velocities from the world's frame to the bodies', ᵣv̆ = R⁻¹ ᵣv (III), and back.
void to_local(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);
void to_world(const std::vector<Matrix3>& rotations, std::vector<Velocity>& v);

/// Steps coordinates, ₜq ← ₜq + hs ₜv̆, ᵣq ← ᵣq ∘ R_q(hs ᵣv̆), with local angular velocities.
void step_coordinates(double hs, const std::vector<Velocity>& v_local, std::vector<Coordinates>& q);

/// Sets λ = 0 for a sub-step that starts with velocities `v`; limits hold for the sum of the step's impulses.
/// Contacts that meet in the sub-step bounce. `sum_v`: A5's sum of velocities, else null. With a warm start λ
/// is a fraction of the last sub-step's impulses, which are applied to `v`.
void start_substep(Problem& problem, std::vector<Velocity>& v, const std::vector<Velocity>* sum_v = nullptr);

/// Returns the number of sweeps of a sub-step for the setting m. The sub-step of an impact, or of a hit on a
/// joint's limit, takes enough to transmit it through joints and rows of touching bodies.
int sweeps_of(const Problem& problem, int m);

/// Updates biases, β_x ← β_x − J̆ v̆, of every position-level row. β of friction that slides is 0. A damped
/// soft limit whose bound is passed acts as a spring from then on.
void update_biases(Problem& problem, const std::vector<Velocity>& v_local);

/// Scales biases, β□ = (τ/κ) β, of every row that is stabilized; the others' fixed point is their own β.
void box_biases(Constraints& c, const Settings& settings);

/// Adds J̆ change to β_x as far as x does not follow the coordinates, and for contacts with their own τ and
/// κ: A5's sum of velocities updates all rows by one factor. The change is (τ/κ) v̆, which led to `sum_v`. β
/// of friction that slides is J̆ sv. Soft limits as in update_biases().
void undo_update_rule(Problem& problem, const Settings& settings, const std::vector<Velocity>& v_local,
                      const std::vector<Velocity>& sum_v);

/// Makes the whole step's problem for A1, from blocks of one row, formulated in the bodies' frames, and local
/// velocities that include ext. Contacts come last, by points: a normal, then its two rows of friction.
void make_mlcp(const Problem& problem, const std::vector<Velocity>& v_local, Mlcp& mlcp);

/// Sets the rows' impulses from the solution `lambda` of make_mlcp()'s problem.
void keep_impulses(const std::vector<double>& lambda, Constraints& c);

/// Applies v̆ ← v̆ + M̆⁻¹J̆ᵀλ, from the impulses M̆^(−1/2)J̆ᵀλ that A1's solver leaves by body.
void add_impulses(const Model& model, const std::vector<Vector6>& impulses, std::vector<Velocity>& v_local);

/// Returns the largest frequency of a body's rotation against the geometric stiffness of its joints, rad/s;
/// at least `least`. Forces are λ/duration of rows formulated singly in the bodies' frames. `stiffness`:
/// buffer for K by body, in the bodies' frames. A joint that pulls with F on a point at the arm r from the
/// centre of mass gives K = (r·F) 1 − (r Fᵀ + F rᵀ)/2, for the torque r × F changes by −K θ as the body turns
/// by θ. Only joints that lock a point count. No mode of the jointed bodies is faster: the stiffness is a sum
/// over bodies, and locks only remove freedom.
double transverse_frequency(const Problem& problem, double duration, double least,
                            std::vector<Matrix3>& stiffness);

/// Returns the largest frequency in the geometric stiffness of joints that bear the weights of a scene at
/// rest, rad/s. Bodies that hang on ball joints alone may swing to where they pull most, and a level chain is
/// not taut at first, so gravity also counts along all axes.
double frequency_at_rest(const Model& model, const std::vector<Contact>& contacts,
                         const std::vector<Coordinates>& q, double h);

/// Appends the impulses of the contacts in the step that was solved last, with the bodies at `q`.
void append_contact_impulses(const Problem& problem, const std::vector<Coordinates>& q,
                             std::vector<ContactImpulse>& result);

}  // namespace substep
