#pragma once
/// The contacts of a step as rows, by manifolds, four manifolds at a time.
///
/// A manifold holds the contact points of one pair of bodies (at most `most_in_manifold`; a pair with more
/// has several). A sweep visits the manifolds one after the other: their normals as one block, then the
/// friction of each point, two rows as one block. Manifolds that share no moving body do not notice each
/// other, and may as well be solved at once, one in each lane of a vector. No lane depends on another, so the
/// bits are those of a sweep manifold by manifold, on every machine.
///
/// The report leaves contacts open ("ignoring friction", IV.3.1; "foreach", proc3:9). Two things are read
/// into it: λ's limits hold for the impulse of the step, not of a sub-step; and a sweep ends at what cannot
/// move.

#include <array>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

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
};

/// One row of each of four manifolds: Row of constraint.h, less what a contact does not need. Its linear part
/// is its direction (ContactDirections), its angular parts are in the bodies' frames, in which moments of
/// inertia are diagonal, so that M⁻¹Jᵀ follows from it: what a sweep reads is most of what it costs.
struct ContactRow {
  LaneVectors angular_a;
  LaneVectors angular_b;
  Lanes beta;     ///< position-level, of the (sub-)step
  Lanes impulse;  ///< λ of the whole step so far
};

/// The normal and the tangents of contact points, in the world's frame.
struct ContactDirections {
  LaneVectors normal;
  LaneVectors tangent[2];
};

struct NormalRow {
  ContactRow row;
  Lanes effective_mass;
  Lanes low;  ///< lower limit of the impulse: 0, or what an impact has given, which stays given
};

/// A corner of the hull of four patches' points, and the hull's side that begins there.
struct PatchCorner {
  LaneVectors plane;     ///< of the cone, by that side: plane · w >= 0 inside
  LaneVectors to_plane;  ///< Γ⁻¹ plane / (planeᵀ Γ⁻¹ plane): projects on the plane
  LaneVectors to_ray;    ///< Γ p / (pᵀ Γ p), with p the wrench of a unit impulse at the corner
  Lanes gamma;           ///< pᵀ Γ p
  Lanes place[2];        ///< along the tangents, m
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
  LaneVectors normal_beta;  ///< β: of the velocity along the normal, and of the turning about the tangents
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
  Lanes corners;          ///< how many corners the patch has
  LaneVectors reference;  ///< what the displacement since the step's start is added to, m, m, rad
  LaneVectors origin;     ///< the impulses when it last slid: those are spent, so that friction can turn
  Lanes origin_normal;
  Lanes slid;    ///< whether it slid when the step began: 1 or 0
  Lanes slides;  ///< whether it slides: 1 or 0
};

/// Restitution of a normal: Newton's law, in the sub-step in which the bodies meet.
struct RestitutionRow {
  Lanes coefficient;           ///< Contact::restitution
  Lanes closes;                ///< Contact::closes: 1 or 0
  Lanes resting_acceleration;  ///< slower than this for a sub-step is at rest, m/s²
  Lanes gap;                   ///< at the coordinates that the row was formulated for, m
  Lanes acceleration;          ///< by gravity, against the normal, m/s²
  Lanes velocity;              ///< along the normal, at least that after this sub-step, m/s
  Lanes right;                 ///< the same as the row's right-hand side: A5 adds J sv
  Lanes
      right_of_slip[2];  ///< the right-hand sides of a contact's friction that stops in the impact: A5's J sv
  Lanes impact;          ///< whether that holds, not β: 1 or 0
};

/// The two rows of a contact point's friction: |λ_t − origin| <= μ (λ_n − origin_normal), a disc.
struct FrictionRows {
  ContactRow row[2];
  Lanes gamma[3];  ///< Γ of the two: 11, 12, 22
  Lanes inverse_determinant;
  Lanes inverse_largest;  ///< of Γ's eigenvalues
  Lanes coefficient;      ///< μ
  Lanes reference[2];     ///< what the point's displacement since the step's start is added to, m
  /// The impulses when it last slid: those are spent, so that friction can turn with the slip in a step.
  Lanes origin[2];
  Lanes origin_normal;
  Lanes slid;    ///< whether it slid when the step began: 1 or 0
  Lanes slides;  ///< whether the disc's edge is reached: 1 or 0
};

/// Arms from the centres of mass to a contact point with friction, in the bodies' frames. They are those of
/// the last formulation: a round body that is formulated anew touches with another point.
struct TouchingPoint {
  LaneVectors arm_a;
  LaneVectors arm_b;
};

/// Coupling of two normals i and j in each of four manifolds: Γ_ij/Γ_ii for i ≠ j, and Γ_ii on the diagonal.
struct Coupling {
  Lanes share;
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
  std::array<int, lanes> count;   ///< of the manifold's contacts: beyond, nothing acts on a lane
  int manifolds;                  ///< lanes beyond repeat the first
  int contacts;                   ///< the largest count
  int frictions;                  ///< of them with friction
  std::array<std::uint8_t, most_in_manifold> contact_of;  ///< by friction
  int first_normal;       ///< normals[first_normal] … , one for each contact
  int first_friction;     ///< frictions[first_friction] …
  int first_coupling;     ///< couplings[first_coupling] …: of the normals, row by row
  int first_restitution;  ///< restitutions[first_restitution] …, one for each contact; −1: none bounces
  int patch;              ///< patches[patch]; −1: the manifolds are solved by points
  int corners;            ///< the largest number of corners of its patches
  int first_corner;       ///< patch_corners[first_corner] …
  std::array<int, lanes> shape;  ///< shapes[shape[lane]] of its patches
  int frictions_of(int lane) const {
    int number = 0;
    while (number < frictions && contact_of[number] < count[lane]) ++number;
    return number;
  }
};

/// Impulses of the rows when the last sub-step began, one entry for each row of ContactBatches. Empty without
/// a warm start.
struct GivenBefore {
  using ByLane = std::array<double, lanes>;
  std::vector<ByLane> normals;
  std::vector<std::array<ByLane, 2>> frictions;
  std::vector<std::array<std::array<ByLane, 3>, 2>> patches;  ///< normals, friction
  double force_of_impulse = 0;                                ///< 1/s
};

class ContactBatches {
 public:
  /// Takes the place of what was there. Contacts of one pair of bodies follow each other. Rows are to be
  /// formulated afterwards; their impulses are 0. Keeps its memory from step to step. `q`: the coordinates
  /// at which the contacts were found; without them there are no new patches. `kept`: patches of the
  /// step before that still hold; their memory is swapped.
  ///
  /// Order: manifolds far from what cannot move come first, those with the world last, by the smaller of both
  /// bodies' distances from it in the graph of contacts; those of one
  /// distance as add_batches() says.
  void build(const Model& model, const std::vector<Contact>& contacts, std::vector<PatchShape>& kept,
             const std::vector<Coordinates>& q);

  /// Stores what the next step needs of the contacts, with the bodies at q: a point that does not slide keeps
  /// its displacement, if it `keeps` any. The memory of `patches_of_state` is swapped.
  void remember(const std::vector<Contact>& found, const std::vector<Coordinates>& q, bool keeps,
                std::vector<ContactMemory>& memory, std::vector<PatchShape>& patches_of_state);

  std::vector<ContactBatch> batches;
  std::vector<NormalRow> normals;
  std::vector<FrictionRows> frictions;
  std::vector<TouchingPoint> touching;        ///< one of each of `frictions`
  std::vector<ContactDirections> directions;  ///< one of each of `normals`
  std::vector<std::uint8_t> slides;           ///< by batch: whether any of its points goes on sliding
  std::vector<RestitutionRow> restitutions;
  std::vector<Coupling> couplings;
  std::vector<PatchShape> shapes;
  std::vector<Patch> patches;
  std::vector<PatchCorner> patch_corners;
  GivenBefore given_before;
  bool has_impact = false;               ///< whether any contact has an impact in the sub-step
  bool bounces = false;                  ///< whether one of them bounces
  int row_count = 0;                     ///< of all manifolds
  int formulations = 0;                  ///< since they were built
  std::vector<Matrix3> first_rotations;  ///< of all bodies at the first of them

 private:
  struct Manifold {
    int distance;  ///< of the nearer body from what cannot move; less is later
    int contacts;
    std::uint32_t friction;  ///< bit i: contact i has friction
    int source;              ///< its first contact; of a kept patch −1
    int corners;             ///< of its patch; 0: it is solved by points
    int shape;
    int a;
    int b;
    std::pair<int, int> colliders;  ///< of its first contact, in ascending order: the order of the file
    bool has_friction_throughout() const;
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
  void list_shapes_of_batches();
  void measure_distances(const Model& model);
  void reserve(const Model& model, std::size_t most);
  void sort_places(const std::vector<Contact>& found);
  void add_batches(const Model& model, const std::vector<Contact>& contacts, std::size_t begin,
                   std::size_t end);
  void add_batch(const Model& model, const std::vector<Contact>& contacts, const Manifold* first, int count);

  /// Numbers of rows and corners that the batches have taken so far.
  struct Counts {
    int normals;
    int frictions;
    int restitutions;
    int couplings;
    int patches;
    int corners;
  };

  Counts counts_{};
  std::vector<Manifold> manifolds_;
  bool had_no_points_ = false;                                ///< when the batches were built
  std::vector<std::tuple<int, int, int>> shapes_of_batches_;  ///< colliders and corners, then
  std::vector<int> in_order_;                                 ///< contacts, as they are remembered
  std::vector<int> place_of_;                                 ///< by contact: its place among them
  std::vector<int> last_batch_;                               ///< by body: the last that it is in
  std::vector<int> distance_;                                 ///< by body: from what cannot move
  std::vector<int> begin_;  ///< by body: of its partners; by collider: of its contacts
  std::vector<int> partners_;
  std::vector<int> reached_;
};

/// s2 of all rows, as formulate() of formulate.h does it: rotations of the coordinates q; rows in the bodies'
/// frames (J̆). What slides lets its displacement go.
void formulate(ContactBatches& contacts, const std::vector<Contact>& found, const std::vector<Coordinates>& q,
               const std::vector<Matrix3>& rotations, double hs);

/// The start of a sub-step: which contacts meet in it with an impact. `v`: velocities before the forces act;
/// `offset`: sum of the velocities since the formulation. `sum_v`: A5's, else null.
void start_substep(ContactBatches& contacts, double hs, const std::vector<Velocity>& v,
                   const std::vector<Velocity>& offset, const std::vector<Velocity>* sum_v);

/// For all rows of a batch: the change of λ in J_x(κ v + M⁻¹J_xᵀλ) = τ β_x : lo, hi, relaxed by ω, and
/// v ← v + scale · M⁻¹J_xᵀ change. `moved`: raised to the largest |change| Γ_xx, if given.
struct RowSolve {
  double kappa = 1;
  double tau = 1;
  double omega = 1;
  double scale = 1;
};
void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved = nullptr);

/// Scales the biases of all rows by τ/κ, as A5 does.
void box_biases(ContactBatches& contacts, const Stabilization& by);

/// Adds `share` of J̆ change to the biases of all rows.
void add_to_biases(ContactBatches& contacts, double share, const std::vector<Velocity>& change);

/// Lets the friction that slides follow no coordinates: its bias is 0, or J̆ sv with A5's sum of velocities
/// `sum_v`, and its displacement counts from `offset`, the sum of velocities since the formulation.
void let_go_of_sliding(ContactBatches& contacts, double hs, const std::vector<Velocity>* sum_v,
                       const std::vector<Velocity>& offset);

}  // namespace substep
