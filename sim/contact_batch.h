#pragma once
/// The contacts of A2 to A5, four pairs of bodies at a time.
///
/// A sweep goes through the pairs of touching bodies one after the other; pairs that share no moving body do
/// not notice each other, and may as well be solved at once, one in each lane of a vector. Each lane does
/// what solve() and apply() of constraint.h do, operation by operation, in the order of the rows: the bits
/// are those of a sweep row by row, on every machine.

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "sim/model.h"
#include "sim/state.h"

namespace substep {

constexpr int lanes = 4;
using Lanes = double __attribute__((vector_size(8 * lanes), aligned(8 * lanes)));

/// The three components of four vectors.
struct LaneVectors {
  Lanes component[3];
  Lanes& operator[](int k) { return component[k]; }
  const Lanes& operator[](int k) const { return component[k]; }
};

/// One row of each of four pairs: Row of constraint.h, less what a contact does not need.
struct ContactRow {
  LaneVectors linear;
  LaneVectors angular_a;
  LaneVectors angular_b;
  LaneVectors response_a;
  LaneVectors response_b;
  Lanes inverse_gamma;
  Lanes beta;
  Lanes impulse;
  Lanes friction;        ///< μ; 0 in a normal's row
  Lanes position_share;  ///< as in Block
  int normal;            ///< friction: its normal, an index of ContactBatches::rows; −1: this is a normal
};

/// Up to four pairs of bodies with equally many contacts, no two sharing a moving body: the normals, then
/// each contact's two friction rows where it has friction.
struct ContactBatch {
  Lanes inverse_mass_a;
  Lanes inverse_mass_b;
  std::array<int, lanes> a;
  std::array<int, lanes> b;
  std::array<int, lanes> source;  ///< the pair's first contact
  int pairs;                      ///< lanes beyond repeat the first
  int contacts;                   ///< of each pair
  bool bounces;                   ///< one of them: not all normals' β follow the coordinates
  int first;                      ///< rows[first] … rows[first + count − 1]
  int count;
};

class ContactBatches {
 public:
  /// Takes the place of what was there. Contacts of one pair of bodies follow each other. Rows are to be
  /// formulated afterwards. Keeps its memory from step to step.
  void build(const Model& model, const std::vector<Contact>& contacts);

  std::vector<ContactBatch> batches;
  std::vector<ContactRow> rows;
  int row_count = 0;  ///< of all pairs

 private:
  struct Pair {
    int level;  ///< pairs that it has to wait for, one after the other
    int contacts;
    std::uint64_t friction;  ///< bit i: contact i has friction
    int source;
    auto operator<=>(const Pair& other) const = default;
    bool fits(const Pair& other) const;  ///< in one batch
  };
  std::vector<Pair> pairs_;
  std::vector<int> depth_;  ///< by body: the level of what comes next
};

/// s2 of all rows, as formulate() of formulate.h does it: rotations of the coordinates q; rows in the bodies'
/// frames (J̆) or in the world's (J).
void formulate(ContactBatches& contacts, const Model& model, const std::vector<Contact>& found,
               const std::vector<Coordinates>& q, const std::vector<Matrix3>& rotations, bool in_body_frames,
               double hs);

/// For all rows of a batch, one after the other: the change of λ in J_x(κ v + M⁻¹J_xᵀλ) = τ β_x : lo, hi,
/// relaxed by ω, and v ← v + scale · M⁻¹J_xᵀ change. `moved`: raised to the largest |change| Γ_xx, if given.
struct RowSolve {
  double kappa = 1;
  double tau = 1;
  double omega = 1;
  double scale = 1;
};
void solve_and_apply(ContactBatches& contacts, const ContactBatch& x, const RowSolve& how,
                     std::vector<Velocity>& v, double* moved = nullptr);

// What constraint.h and formulate.h do to rows, for all of these.
void clear_impulses(ContactBatches& contacts);
void update_biases(ContactBatches& contacts, const std::vector<Velocity>& v_local);
void box_biases(ContactBatches& contacts, double kappa, double tau);
void undo_update_rule(ContactBatches& contacts, const std::vector<Velocity>& change);

}  // namespace substep
