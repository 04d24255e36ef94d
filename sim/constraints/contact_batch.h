#pragma once
/// The contacts of a step as rows, by manifolds, four manifolds at a time.
///
/// A manifold holds contact points of one pair of bodies, at most `most_in_manifold`, that either all have
/// friction or none. A sweep solves one manifold after the other: its normals as one block, then the friction
/// of each point, two rows as one block. Manifolds without a common moving body are solved at once, one in
/// each lane of a vector. No lane depends on another, so the bits are those of a sweep manifold by manifold,
/// on every machine.
///
/// The report leaves contacts open ("ignoring friction", IV.3.1; "foreach", proc3:9). We add two rules: λ's
/// limits hold for the impulse of the step, not of a sub-step; and a sweep ends at fixed bodies.

#include <array>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "sim/math/four_wide.h"
#include "sim/model/model.h"
#include "sim/model/settings.h"
#include "sim/model/state.h"

namespace substep {

constexpr int lanes = 4;
constexpr int most_in_manifold = 16;
using Lanes = double __attribute__((vector_size(8 * lanes), aligned(8 * lanes)));

/// The three components of four vectors.
struct LaneVectors {
  Lanes component[3];
  Lanes& operator[](int k) { return component[k]; }
  const Lanes& operator[](int k) const { return component[k]; }
  Lanes* begin() { return component; }
  Lanes* end() { return component + 3; }
  Vector3 lane(int i) const { return {component[0][i], component[1][i], component[2][i]}; }
};

/// One row of each of four manifolds: Row of constraint.h without the fields that a contact does not need.
/// Its linear part is its direction (ContactDirections). Its angular parts are in the bodies' frames, in
/// which moments of inertia are diagonal, so that M⁻¹Jᵀ follows from them and is not stored: reading rows is
/// most of a sweep's cost.
struct ContactRow {
  LaneVectors angular_a;
  LaneVectors angular_b;
  Lanes beta;     ///< position-level, of the (sub-)step
  Lanes impulse;  ///< λ of the whole step so far
};

/// The normal and the tangents of contact points, in one frame: the world's in ContactBatches.
struct ContactDirections {
  LaneVectors normal;
  LaneVectors tangent[2];
};

struct NormalRow {
  ContactRow row;
  Lanes effective_mass;
  Lanes low;  ///< lower limit of the impulse: 0, or the impulse of an impact, which is never taken back
};

/// A corner of the hull of four patches' points, and the hull's side that begins there.
struct PatchCorner {
  LaneVectors plane;     ///< of the cone, by that side: plane · w >= 0 inside
  LaneVectors to_plane;  ///< Γ⁻¹ plane / (planeᵀ Γ⁻¹ plane): projects on the plane
  LaneVectors to_ray;    ///< Γ p / (pᵀ Γ p), with p the wrench of a unit impulse at the corner
  Lanes gamma;           ///< pᵀ Γ p
  Lanes position[2];     ///< along the tangents, m
  Lanes friction[2];     ///< impulse of a patch that slides, along the tangents, since its origin
};

/// Up to four patches.
struct Patch {
  LaneVectors in_world[3];  ///< the axes
  LaneVectors in_a[3];      ///< the axes in a's frame
  LaneVectors in_b[3];
  LaneVectors arm_a;  ///< from a's centre of mass to the patch's centre, along the axes
  LaneVectors arm_b;
  // Normals: the force along the normal, and the torques about the tangents.
  LaneVectors normal_beta;  ///< β: of the velocity along the normal, and of the rotation about the tangents
  LaneVectors normal_impulse;  ///< λ of the whole step so far
  Lanes normal_gamma[6];       ///< Γ of the three: 11, 12, 13, 22, 23, 33
  Lanes normal_inverse[6];     ///< Γ⁻¹; of two corners, on the wrenches that they can give
  // Friction: the forces along the tangents, and the torque about the normal.
  LaneVectors beta;
  LaneVectors impulse;
  Lanes gamma[6];
  Lanes inverse[6];
  Lanes by_normals[9];    ///< change of the friction's velocities by the normals' wrench, row by row
  Lanes inverse_largest;  ///< 1 / the larger eigenvalue of the tangents' Γ
  Lanes inverse_twist;    ///< 1 / Γ of the twist
  Lanes inverse_radius;   ///< 1/m
  Lanes coefficient;      ///< μ
  Lanes corners;          ///< number of corners
  LaneVectors reference;  ///< displacement of friction when the step began; m, m, rad
  /// Impulses when the patch last slid. The limit holds for the impulse since then, so that friction can
  /// change its direction within a step.
  LaneVectors origin;
  Lanes origin_normal;
  Lanes slid;    ///< 1 where the patch slid when the step began, else 0
  Lanes slides;  ///< 1 where the patch slides, else 0
};

/// Restitution of a normal: Newton's law, in the sub-step in which the bodies meet.
struct RestitutionRow {
  Lanes coefficient;           ///< Contact::restitution
  Lanes closes;                ///< Contact::closes as 1 or 0
  Lanes resting_acceleration;  ///< an impact slower than this times hs is at rest, m/s²
  Lanes gap;                   ///< at the coordinates that the row was formulated for, m
  Lanes acceleration;          ///< by gravity, against the normal, m/s²
  /// Right-hand sides in an impact, of the normal and the tangents, m/s: the least velocity after the
  /// sub-step, and 0; A5 adds J sv.
  Lanes right[3];
  Lanes impact;  ///< 1 where `right` holds in place of β, else 0
};

/// The two rows of a contact point's friction: |λ_t − origin| <= μ (λ_n − origin_normal), a disc.
struct FrictionRows {
  ContactRow row[2];
  Lanes gamma[3];  ///< Γ of the two: 11, 12, 22
  Lanes inverse_determinant;
  Lanes inverse_largest;  ///< of Γ's eigenvalues
  Lanes coefficient;      ///< μ
  Lanes reference[2];     ///< displacement of the point when the step began, m
  /// Impulses when the point last slid. The limit holds for the impulse since then, so that friction can turn
  /// with the slip within a step.
  Lanes origin[2];
  Lanes origin_normal;
  Lanes slid;    ///< 1 where the point slid when the step began, else 0
  Lanes slides;  ///< 1 where the impulse is on the disc's edge, else 0
};

/// Arms from the centres of mass to a contact point, in the bodies' frames.
struct PointArms {
  LaneVectors a;
  LaneVectors b;
};

/// Up to four manifolds, no two sharing a moving body.
struct ContactBatch {
  Lanes inverse_mass_a;
  Lanes inverse_mass_b;
  LaneVectors inverse_inertia_a;
  LaneVectors inverse_inertia_b;
  std::array<int, lanes> a;
  std::array<int, lanes> b;
  std::array<int, lanes> source;  ///< the manifold's first contact
  std::array<int, lanes> count;   ///< number of the manifold's contacts; later ones do not act on its lane
  int manifolds;                  ///< lanes beyond repeat the first
  int contacts;                   ///< the largest count
  bool has_friction;              ///< its points have friction
  bool has_impacts;               ///< some of its points have restitution or are stopped at once
  int first_point;                ///< normals[first_point], frictions[first_point], …: one for each contact
  int first_coupling;             ///< couplings[first_coupling] …: of the normals, row by row
  int patch;                      ///< patches[patch]; −1: the manifolds are solved by points
  int corners;                    ///< the largest number of corners of its patches
  int first_corner;               ///< patch_corners[first_corner] …
  std::array<int, lanes> shape;   ///< shapes[shape[lane]] of its patches
};

/// Coupling of two normals i and j in each of four manifolds: Γ_ij/Γ_ii for i ≠ j, and Γ_ii on the diagonal.
struct Coupling {
  Lanes value;
};

/// The rows of a batch that is solved by points: of each array one element for each contact.
struct PointRows {
  NormalRow* normals;
  FrictionRows* frictions;  ///< used where the batch has friction
  PointArms* arms;
  ContactDirections* directions;
  RestitutionRow* restitutions;  ///< null where the batch has no impacts
  Coupling* couplings;           ///< of the normals, row by row
};

/// Impulses of the rows, of the step so far, when the last sub-step began. Empty without a warm start.
struct StartImpulses {
  using ByLane = std::array<double, lanes>;
  std::vector<std::array<ByLane, 3>> points;                  ///< normal, friction
  std::vector<std::array<std::array<ByLane, 3>, 2>> patches;  ///< normals, friction
  double force_of_impulse = 0;                                ///< 1/s
};

class ContactBatches {
 public:
  /// Builds the batches from the contacts of a step, of which those of one pair of bodies follow each other.
  /// Rows are to be formulated afterwards; their impulses are 0. Keeps its memory from step to step. `q`: the
  /// coordinates at which the contacts were found; without them there are no new patches. `kept`: patches of
  /// the step before that still hold; their memory is swapped.
  ///
  /// Manifolds far from fixed bodies come first and those with the world last, by the smaller distance of
  /// both bodies from a fixed one in the graph of contacts; add_batches() orders those of one distance.
  void build(const Model& model, const std::vector<Contact>& contacts, std::vector<PatchShape>& kept,
             const std::vector<Coordinates>& q);

  /// Stores the contact cache for the next step, with the bodies at q. A point that does not slide keeps its
  /// displacement where `keeps` is true. The memory of `patches_of_state` is swapped.
  void remember(const std::vector<Contact>& found, const std::vector<Coordinates>& q, bool keeps,
                std::vector<ContactMemory>& memory, std::vector<PatchShape>& patches_of_state);

  /// Returns the rows of a batch that is solved by points.
  PointRows points_of(const ContactBatch& x) {
    return {normals.data() + x.first_point,
            frictions.data() + x.first_point,
            touching.data() + x.first_point,
            directions.data() + x.first_point,
            x.has_impacts ? restitutions.data() + x.first_point : nullptr,
            couplings.data() + x.first_coupling};
  }

  std::vector<ContactBatch> batches;
  std::vector<NormalRow> normals;
  std::vector<FrictionRows> frictions;
  /// Arms of the last formulation: a round body that is formulated anew touches with another point.
  std::vector<PointArms> touching;
  std::vector<ContactDirections> directions;
  std::vector<RestitutionRow> restitutions;
  std::vector<Coupling> couplings;
  std::vector<std::uint8_t> slides;  ///< by batch: 1 where any of its points continues to slide
  std::vector<PatchShape> shapes;
  std::vector<Patch> patches;
  std::vector<PatchCorner> patch_corners;
  StartImpulses start_impulses;
  bool has_impact = false;               ///< some contact has an impact in the sub-step
  bool bounces = false;                  ///< some contact bounces in the sub-step
  int row_count = 0;                     ///< of all manifolds
  int formulations = 0;                  ///< number since build()
  std::vector<Matrix3> first_rotations;  ///< of all bodies at the first formulation

 private:
  struct Manifold {
    int distance = 0;  ///< of the nearer body from fixed ones; smaller ones come later
    int contacts = 0;
    bool has_friction = true;
    int source = -1;  ///< its first contact; of a kept patch −1
    int corners = 0;  ///< of its patch; 0: it is solved by points
    int shape = 0;    ///< of its patch
    int a;
    int b;
    std::pair<int, int> colliders;  ///< of its first contact, in ascending order: the order of the file
    bool is_shorter(const Manifold& other) const;
    bool fits(const Manifold& other) const;  ///< in one batch
  };
  /// Manifolds that a lane takes one after the other.
  struct Run {
    std::size_t begin;
    std::size_t end;
    bool backwards;
    std::size_t size() const { return end - begin; }
    std::size_t next(bool at_other_end) const { return backwards != at_other_end ? end - 1 : begin; }
    void take(bool at_other_end) { backwards != at_other_end ? --end : ++begin; }
  };
  void list_manifolds(const Model& model, const std::vector<Contact>& contacts,
                      const std::vector<Coordinates>& q);
  bool have_shapes_of_batches() const;
  void measure_distances(const Model& model);
  void reserve(const Model& model, std::size_t most);
  void sort_by_colliders(const std::vector<Contact>& found);
  void add_batches(const Model& model, const std::vector<Contact>& contacts, std::size_t begin,
                   std::size_t end);
  void add_batch(const Model& model, const std::vector<Contact>& contacts, const Manifold* first, int count);

  /// Numbers of rows and corners that the batches have taken so far.
  struct Counts {
    int points;
    int couplings;
    int patches;
    int corners;
  };

  Counts counts_{};
  std::vector<Manifold> manifolds_;
  bool had_no_points_ = false;                                ///< when the batches were built
  std::vector<std::tuple<int, int, int>> shapes_of_batches_;  ///< colliders and corners when they were built
  std::vector<int> in_order_;                                 ///< contacts in the order of the cache
  std::vector<int> position_of_;                              ///< by contact: its position in `in_order_`
  std::vector<int> last_batch_;                               ///< by body: its last batch
  std::vector<int> distance_;                                 ///< by body: from fixed ones
  std::vector<int> begin_;  ///< by body: of its partners; by collider: of its contacts
  std::vector<int> partners_;
  std::vector<int> reached_;
};

/// s2 of all rows, as formulate() of formulate.h does it: rotations of the coordinates q; rows in the bodies'
/// frames (J̆). Resets the displacement of points that slide.
void formulate(ContactBatches& contacts, const std::vector<Contact>& found, const std::vector<Coordinates>& q,
               const std::vector<Matrix3>& rotations, double hs);

/// Starts a sub-step: sets which contacts have an impact in it. `v`: velocities before the forces act;
/// `offset`: sum of the velocities since the formulation. `sum_v`: A5's, else null.
void start_substep(ContactBatches& contacts, double hs, const std::vector<Velocity>& v,
                   const std::vector<Velocity>& offset, const std::vector<Velocity>* sum_v);

/// Factors of the solution of a batch: the change of λ in J_x(κ v + M⁻¹J_xᵀλ) = τ β_x : lo, hi, relaxed by ω,
/// and v ← v + scale · M⁻¹J_xᵀ change.
struct RowSolve {
  double kappa = 1;
  double tau = 1;
  double omega = 1;
  double scale = 1;
};

/// Solves all rows of a batch. `moved`: raised to the largest |change| Γ_xx, if given.
void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved = nullptr);

/// Scales the biases of all rows by τ/κ, as A5 does.
void box_biases(ContactBatches& contacts, const Stabilization& by);

/// Adds `factor` · J̆ change to the biases of all rows.
void add_to_biases(ContactBatches& contacts, double factor, const std::vector<Velocity>& change);

/// Sets the bias of friction that slides to 0, or to J̆ sv with A5's sum of velocities `sum_v`. Its
/// displacement counts from `offset`, the sum of velocities since the formulation.
void release_sliding(ContactBatches& contacts, double hs, const std::vector<Velocity>* sum_v,
                     const std::vector<Velocity>& offset);

/// Sets StartImpulses such that the last sub-step of the step before, of `duration` seconds, had the forces
/// of Contact and PatchShape. `scale`: the factor of A5's impulses relative to λ□.
void set_start_impulses(ContactBatches& contacts, const std::vector<Contact>& found, double duration,
                        double scale);

/// Starts a sub-step warm: λ ← λ + fraction · the last sub-step's impulse, and v ← v + scale · M⁻¹Jᵀ of it.
/// Manifolds with an impact start from 0.
void warm_start(ContactBatches& contacts, double fraction, double scale, std::vector<Velocity>& v);

/// Calls `what` with each row of the first `count` points of a batch: the index of the point, 0 for the
/// normal or 1 and 2 for the tangents, the direction, and the row.
template <typename Batches, typename Function>
SUBSTEP_KERNEL void for_each_row(Batches& contacts, const ContactBatch& x, int count, const Function& what) {
  for (int i = 0; i < count; ++i) {
    const int point = x.first_point + i;
    const ContactDirections& along = contacts.directions[point];
    what(i, 0, along.normal, contacts.normals[point].row);
    for (int k = 0; k < 2 && x.has_friction; ++k)
      what(i, 1 + k, along.tangent[k], contacts.frictions[point].row[k]);
  }
}

}  // namespace substep
