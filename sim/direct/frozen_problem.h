#pragma once
/// Friction problems frozen at one step, as files hold them: Siconos' plain text, which has the matrix of the
/// contacts alone, and substep's, which has the rows of bodies.
///
/// Siconos' text is a list of numbers: 3, the number of contacts, the storage of the matrix W, its rows and
/// columns, W, q, μ. Storage 0 is dense: rows and columns again, values row by row. Storage 1 is blocks: the
/// number of stored blocks, of block rows and of block columns; the ends of block rows and of block columns;
/// the number of row pointers and of stored blocks; row pointers; block columns; then each block's number and
/// its values column by column. A contact's three components are its normal and its two tangents. The
/// problem: u = W r + q, r in the cone of friction, u + μ |u_t| n in the dual cone, and the two orthogonal.

#include <Eigen/SparseCore>
#include <string>
#include <string_view>
#include <vector>

#include "sim/direct/mlcp.h"

namespace substep {

struct FrozenProblem {
  Mlcp mlcp;                           ///< its rows have parts where `has_bodies`
  Eigen::SparseMatrix<double> matrix;  ///< Γ + S
  bool has_bodies = false;

  /// Returns the number of normal rows that have friction.
  int contacts() const;
  /// Returns the largest |W_ij − W_ji| over the largest |W_ij|.
  double asymmetry() const;
};

/// Returns the problem as substep's text, numbers at round-trip precision. A run writes the text of a problem
/// that it could not solve.
std::string to_text(const Mlcp& problem);

/// Reads the text of to_text(). Throws Error that begins with `what`, a file's name, and the line.
Mlcp parse_mlcp(std::string_view text, const std::string& what);

/// Reads either format. Throws Error that begins with `what` and the line.
FrozenProblem parse_frozen_problem(std::string_view text, const std::string& what);

/// Returns true where rows i and i + 1 are the tangents of one contact.
bool are_tangents(const Mlcp& mlcp, std::size_t i);

/// Returns the problem in Siconos' text, its matrix in blocks. Throws Error where rows are no contacts with
/// two tangents.
std::string to_siconos_text(const FrozenProblem& problem);

/// Distance of impulses from a solution, by formulas that no solver here uses.
struct ConeError {
  /// |λ − P(λ − u − μ |u_t| n)|, P the projection on the cone of friction (of other rows: on their limits), over
  /// the largest of |q|, |λ| and |u|, the value that Siconos compares with its tolerance.
  double natural_map = 0;
  double complementarity = 0;  ///< largest |λ · (u + μ |u_t| n)| of a contact, over the same squared
};
ConeError cone_error(const FrozenProblem& problem, const std::vector<double>& lambda);

/// Solves row by row, as A2 does: each normal, then the two rows of its friction, as one block within the
/// disc. Continues from `lambda`.
void sweep_rows(const FrozenProblem& problem, std::vector<double>& lambda, int sweeps);

/// Solves by A1's solver: in the bodies' space where there are bodies, else in that of the rows.
MlcpReport solve(const FrozenProblem& problem, std::vector<double>& lambda);

}  // namespace substep
