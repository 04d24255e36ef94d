#pragma once
/// The mixed linear complementarity problem of a whole step, and its direct solver (A1).
///
/// Find λ with w = Γλ + Sλ − b such that
///     λ = low ⇒ w >= 0,   λ = high ⇒ w <= 0,   else w = 0,
/// where Γ = G Gᵀ, G = J M^(−1/2), b = β − J(v + ext), S the rows' softness. A contact's two friction rows
/// have a disc as their limit, and a sliding contact's impulse is opposite to its slip:
///     |λ_t| <= μ λ_n,   w_t ≠ 0 ⇒ λ_t = −μ λ_n w_t/|w_t|,
/// with λ_n the normal's impulse of the same solution: coupled, not that of an earlier step or iteration.
/// They are rows that follow each other and have the same normal, μ, softness and bodies, with tangents
/// across each other: any two, the law does not depend on them. A friction row by itself has the limits ±μ
/// λ_n.
///
/// Γ may be singular: four contacts of a face, a door on three hinges, a closed loop. Velocities are then
/// unique, impulses are not. Where the right sides of such rows contradict one another, as a closed loop's do
/// by rounding and drift, no λ solves all of them: they are solved in the least-squares sense.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "sim/math/vector.h"

namespace substep {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Mlcp {
  struct Row {
    int a;  ///< bodies; −1 is one that cannot move
    int b;
    Vector6 part_a;  ///< row of J M^(−1/2), body a's part: linear, angular
    Vector6 part_b;
    double right;  ///< b
    double low;    ///< limits of λ
    double high;
    double softness;      ///< >= 0
    int normal = -1;      ///< friction: index of the normal's row; low and high are then unused
    double friction = 0;  ///< friction: μ
    double start = 0;     ///< guess of λ, which the active sets start from

    bool has_limits() const { return normal >= 0 || std::isfinite(low) || std::isfinite(high); }
    /// Returns Γ_xx.
    double gamma() const { return (a >= 0 ? part_a.squaredNorm() : 0) + (b >= 0 ? part_b.squaredNorm() : 0); }
    /// Returns the row of G y, with y by body.
    double velocity(const std::vector<Vector6>& y) const {
      double velocity = 0;
      if (a >= 0) velocity += part_a.dot(y[a]);
      if (b >= 0) velocity += part_b.dot(y[b]);
      return velocity;
    }
    /// Adds an impulse to Gᵀλ, by body.
    void add_impulse(double impulse, std::vector<Vector6>& y) const {
      if (a >= 0) y[a] += impulse * part_a;
      if (b >= 0) y[b] += impulse * part_b;
    }
  };
  int bodies = 0;
  std::vector<Row> rows;
};

struct MlcpReport {
  enum class Status {
    solved,
    /// No solution, as redundant rows contradict one another; all others are solved. The rest of the right
    /// sides lies in directions in which Γ is nearly zero: see `rank_tolerance`.
    least_squares,
    unsolved,  ///< no solution to `tolerance` found; perhaps friction has none
  };
  Status status = Status::solved;
  /// Largest natural residual |λ − clamp(λ − w/(Γ_xx + S_xx))| √Γ_xx over the rows, relative to the
  /// largest |b|/√Γ_xx: has no unit, and does not change with mass, length or time. A pair of friction rows
  /// has one, with the nearest point of its disc in place of clamp, and the larger eigenvalue of its block as
  /// Γ_xx.
  double residual = 0;
  int contradicting = 0;        ///< rows with a larger residual than `tolerance`, where not solved
  int active_sets = 0;          ///< active sets tried
  std::int64_t row_solves = 0;  ///< rows × active sets
};

/// Solves by the proximal point method over primal–dual active sets. (Γ + S + εD)λ = b + εDc, with D =
/// diag(Γ) and c a centre, has one solution even where Γ is singular and where contacts that cannot all close
/// lie 1e-8 apart. Given which rows are at which limit, the others are one linear system, solved in the
/// bodies' space: 1 + Gᵀ(εD + S)⁻¹G is factored by blocks of six with little fill, whatever Γ's rank. The
/// rows' signs say which set is next. When the set stays, the centre moves to λ, until the rows of the
/// problem itself hold.
///
/// A pair that slides has an impulse of μ λ_n along a direction, and across it a row with softness |w_t|/(μ
/// λ_n): this is Newton's method on the disc's law. The direction follows λ − w/Γ_xx from set to set, like
/// the signs.
///
/// The residual that moves of the centre leave lies in directions in which Γ is nearly zero. The moves end
/// when it is redundant to `rank_tolerance` and no row with limits has a part in it. Further moves would
/// drive impulses apart, and in the end velocities: they would stop a closed loop for 1e-6 of a right side.
///
/// ε is small at first. The active sets start from the guess of λ, then from all rows free, as in scenes at
/// rest. An interior point method solves problems without a guess, as at a scene's start: its impulses are in
/// the middle of all solutions, and good guesses for the next steps.
///
/// Where these methods fail, ε starts large, so that few rows reach their limits at once. At first every set
/// moves the centre, and ε falls and rises with the residual: pseudo-transient continuation (Kelley and
/// Keyes, 1998). Then the interior point method follows for problems with a guess. At last the centre moves
/// when a few sets have solved the problem about it to a fraction of the residual; ε is halved where they do,
/// and raised where they do not: the inexact proximal point method. A solver keeps its buffers from call to
/// call, not its results: equal problems with equal guesses have equal solutions.
class MlcpSolver {
 public:
  virtual ~MlcpSolver() = default;

  static constexpr double tolerance = 1e-9;  ///< of MlcpReport::residual
  /// Residual at which problems with limits end before another set is factored.
  static constexpr double accurate = 1e-12;
  /// Residual at which problems with limits end as soon as a set is no better.
  static constexpr double nearly_accurate = 1e-11;
  /// A combination r of rows, scaled so that Γ's diagonal is 1, is redundant where rᵀ(Γ + S)r is at most this
  /// fraction of |r|². The bodies' velocities, weighted by the roots of their masses, then change by less
  /// than the fraction's root, 1e-4, times |r|.
  static constexpr double rank_tolerance = 1e-8;

  /// Solves for `lambda`, one impulse for each row, which is finite for a finite problem.
  MlcpReport solve(const Mlcp& problem, std::vector<double>& lambda);

  /// Returns Gᵀλ of the last solution, by body.
  const std::vector<Vector6>& impulses() const { return y_; }

 protected:  // A solver without bodies (frozen_solution.cpp) overrides the virtual functions.
  using Row = Mlcp::Row;
  enum class Set : std::int8_t { free, low, high, inactive, slides };  ///< inactive: λ = 0

  /// Two rows are a pair if they are one contact's tangents.
  enum class Pair : std::int8_t { none, first, second };
  struct Slip {
    Vector2 along = Vector2::Zero();  ///< of the impulse: against the slip
    double across = 0;                ///< softness of the impulse across it
  };

  /// Returns the largest impulse of a friction row, with `value` as its normal's.
  static double limit(const Row& row, double value) { return row.friction * std::max(value, 0.0); }
  static Vector2 across(const Vector2& along) { return {-along.y(), along.x()}; }

  // mlcp.cpp: the problem, its residual and the order of the methods
  const std::vector<Row>& rows() const { return problem_->rows; }
  virtual void prepare();                       ///< sizes the arrays, and sets Γ_xx and pairs
  virtual void velocities();                    ///< sets w = Γλ + Sλ − b, and y = Gᵀλ
  Vector2 target_of_pair(std::size_t i) const;  ///< returns λ − w/(Γ_xx + S_xx)
  void set_scale();                             ///< sets `scale_` to the largest |b|/√Γ_xx
  /// Sets the rows' natural residuals from their velocities w. Returns the largest, relative to `scale_`.
  double natural_residual();
  double residual();         ///< updates w and returns natural_residual()
  void add_proximal_term();  ///< adds εD(λ − c) to w
  double keep_if_better();   ///< keeps λ in `best_` where its residual is the least; returns the residual
  /// Returns whether the rest of the rows is a contradiction among redundant ones. Overwrites y_.
  virtual bool rest_is_redundant();
  bool rest_has_limits() const;  ///< returns true where a row with limits has a part in the rest
  /// Keeps λ if its residual `now` is a contradiction among redundant rows without limits: further moves
  /// would only drive their impulses apart. Returns whether it is.
  bool keep_if_redundant(double now);
  int violated() const;  ///< returns the number of rows whose residual is above `tolerance`
  void guess();          ///< sets λ to its guess
  /// Tries one method after the other until one leads to a solution.
  void try_methods();

  // mlcp_iteration.cpp. The functions that solve return true if they ended at a redundant contradiction.
  Set set_of_pair(std::size_t i, const Vector2& target, double radius, double diagonal);
  int classify();     ///< selects each row's set from λ − w/Γ_xx; returns the number of changed ones
  void fix_limits();  ///< moves λ of the rows at limits to these
  void solve_set();   ///< solves for λ of the free and sliding rows, about the centre
  /// The first set: that of the impulses, or all rows free, unless many of these then reach their limits.
  enum class Start : std::int8_t { impulses, perhaps_free };
  bool solve_active_sets(Start start);
  /// Solves the next set about the centre.
  void take_set();
  /// Moves the centre with every set, with ε in proportion to the residual.
  bool solve_transient();
  /// Moves the centre when its sets have all but settled.
  bool solve_by_centres();

  // mlcp_factorisation.cpp
  void analyse();
  void order_bodies();
  int block_of(int p, int q) const;
  void list_updates();
  void add_product(std::size_t row_index, const Vector6& column_a, const Vector6& column_b,
                   const Vector6& row_a, const Vector6& row_b, double factor);
  void add_waiting_products();
  void add_slide(std::size_t i);
  void clear_blocks();
  void eliminate();
  virtual void factor();
  void solve_blocks();
  virtual void solve_free();

  // mlcp_interior.cpp
  /// A row, or a contact's normal and its friction, strictly within its limits: λ √Γ_xx and w/√Γ_xx,
  /// both over `scale_`. The products of λ's distances and their multipliers go to zero
  /// together, and so does that of (μλ_n, λ_t) and (`speed`, w_t), which stay in their cones.
  struct Unit {
    std::array<int, 3> row{};  ///< normal and friction; −1: none
    bool has_low = false;
    bool has_high = false;
    double friction = 0;
    Vector3 lambda = Vector3::Zero();
    double above = 1;  ///< λ − low
    double below = 1;  ///< high − λ
    double lower = 0;  ///< w = lower − upper
    double upper = 0;
    double speed = 1;  ///< > |slip|
    Vector2 slip = Vector2::Zero();
    Vector3 defect = Vector3::Zero();       ///< velocities less those that multipliers and slip stand for
    Matrix3 law = Matrix3::Zero();          ///< −dλ/dw of the limits
    Matrix3 damping = Matrix3::Identity();  ///< (1 + law · softness)⁻¹
    Matrix3 weight = Matrix3::Zero();       ///< −dλ/dw with softness
    Matrix2 inverse = Matrix2::Zero();
    // Changes by the step:
    Vector3 change = Vector3::Zero();  ///< of λ
    double lower_change = 0;
    double upper_change = 0;
    double speed_change = 0;
    Vector2 slip_change = Vector2::Zero();
    int rows() const { return row[1] < 0 ? 1 : 3; }
    bool is_limited() const { return has_low || has_high; }
  };
  /// Lists rows and contacts as units. Returns false where the method lacks a row: see solve_interior().
  bool list_units();
  void start_unit(Unit& unit) const;
  void set_defects();
  void set_weight(Unit& unit) const;
  static Vector3 change_with_fixed_bodies(const Unit& unit, double t);
  void set_directions(double t);
  static double length_of_step(const Unit& unit);
  double common_length() const;
  double mean_product(double length) const;
  void factor_units();
  void take_step();
  /// Leaves the best λ of an interior point method. Returns false where the problem has rows that the method
  /// lacks: friction in single rows, or limits that are equal.
  virtual bool solve_interior();

  const Mlcp* problem_ = nullptr;
  std::vector<double> lambda_;
  MlcpReport report_;
  double proximal_ = 0;        // ε
  bool is_limited_ = false;    // any row has limits
  std::vector<double> gamma_;  // Γ_xx
  std::vector<double> root_gamma_;
  std::vector<double> w_;
  std::vector<double> natural_;  // natural residual, an impulse
  double scale_ = 0;             // size that residuals are divided by
  std::vector<Pair> pair_;
  std::vector<Slip> slip_;  // by row: of the pair whose first row it is
  double turned_ = 0;       // largest change of a slip's direction in the last set
  std::vector<Set> set_;
  std::vector<Vector6> y_;            // Gᵀλ by body
  std::vector<double> known_lambda_;  // λ of the last velocities(), whose results follow
  std::vector<double> known_w_;
  std::vector<Vector6> known_y_;
  std::vector<Vector6> step_;     // change of velocity by body
  std::vector<Vector6> ordered_;  // the same by position in the order of elimination
  std::vector<double> best_;
  std::vector<double> centre_;
  std::vector<Unit> units_;  // solve_interior
  std::vector<int> unit_of_;

  // The block factorisation of 1 + Gᵀ(εD + S)⁻¹G: pattern, then numbers.
  std::vector<std::pair<int, int>> pattern_;  // body pairs, as analysed last
  std::vector<std::pair<int, int>> pairs_;
  std::vector<int> order_;            // elimination order of bodies
  std::vector<int> position_;         // of a body in `order_`
  std::vector<int> neighbour_begin_;  // by position: first of its later neighbours, as positions
  std::vector<int> neighbours_;
  std::vector<int> update_begin_;  // by position: first block of its Schur complement
  std::vector<int> updates_;
  std::vector<int> row_blocks_;   // by row: blocks of (a, b) and (b, a)
  std::vector<Matrix6> blocks_;   // diagonal, then upper and lower of each neighbour pair
  std::vector<Matrix6> inverse_;  // of the diagonal blocks
  static constexpr int most_products = 16;
  /// Products of columns and rows of the same two bodies, which are added to the blocks together.
  struct Products {
    int row = 0;  ///< the first one's
    int a = -1;
    int b = -1;
    int count = 0;
    std::array<Vector6, most_products> columns_a;
    std::array<Vector6, most_products> columns_b;
    std::array<Vector6, most_products> rows_a;
    std::array<Vector6, most_products> rows_b;
  };
  Products products_;
};

}  // namespace substep
