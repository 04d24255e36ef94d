#include "sim/direct/frozen_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "sim/direct/direct_solver.h"
#include "sim/direct/mlcp_matrix.h"
#include "sim/direct/mlcp_text.h"
#include "sim/error.h"

namespace substep {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr int dimension = 3;
constexpr int most_contacts = 1000;
constexpr double infinite = std::numeric_limits<double>::infinity();

/// The words of a text, with the line of the last one.
class Words {
 public:
  Words(std::string_view text, const std::string& what) : rest_(text), what_(what) {}

  [[noreturn]] void fail(const std::string& trouble) const {
    throw Error(fmt::format("{}:{}: {}", what_, line_, trouble));
  }

  bool is_at_end() {
    while (!rest_.empty() && is_space(rest_.front())) skip();
    return rest_.empty();
  }

  /// `name` says what the number is.
  int integer(std::string_view name, int low, int high) {
    const int value = number<int>(name);
    if (value < low || value > high) fail(fmt::format("{} is {}: expected {} to {}", name, value, low, high));
    return value;
  }

  double real(std::string_view name) {
    const auto value = number<double>(name);
    if (!std::isfinite(value)) fail(fmt::format("{} is not finite", name));
    return value;
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

  void skip() {
    if (rest_.front() == '\n') ++line_;
    rest_.remove_prefix(1);
  }

  template <typename Number>
  Number number(std::string_view name) {
    if (is_at_end()) fail(fmt::format("the file ends before {}", name));
    std::size_t length = 0;
    while (length < rest_.size() && !is_space(rest_[length])) ++length;
    std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    const std::string_view whole = word.substr(0, 40);
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size())
      fail(fmt::format("'{}' is no {} for {}", whole, std::is_same_v<Number, int> ? "whole number" : "number",
                       name));
    return value;
  }

  std::string_view rest_;
  const std::string& what_;
  int line_ = 1;
};

void read_dense(Words& words, int size, Triplets& values) {
  words.integer("the number of rows, again", size, size);
  words.integer("the number of columns, again", size, size);
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const double value = words.real("a value of the matrix");
      if (value != 0) values.emplace_back(row, column, value);
    }
  }
}

/// Reads the ends of block rows, or of block columns; returns them with a 0 before.
std::vector<int> read_ends(Words& words, int blocks, int size) {
  std::vector<int> ends{0};
  for (int i = 0; i < blocks; ++i) ends.push_back(words.integer("the end of a block", ends.back() + 1, size));
  if (ends.back() != size) words.fail(fmt::format("blocks end at {}, not at {}", ends.back(), size));
  return ends;
}

void read_blocks(Words& words, int size, Triplets& values) {
  const int stored = words.integer("the number of blocks", 0, size * size);
  const int block_rows = words.integer("the number of block rows", 1, size);
  const int block_columns = words.integer("the number of block columns", 1, size);
  const std::vector<int> row_ends = read_ends(words, block_rows, size);
  const std::vector<int> column_ends = read_ends(words, block_columns, size);
  words.integer("the number of row pointers", block_rows + 1, block_rows + 1);
  words.integer("the number of block columns' indices", stored, stored);
  std::vector<int> pointers;
  for (int i = 0; i <= block_rows; ++i)
    pointers.push_back(words.integer("a row pointer", i == 0 ? 0 : pointers.back(), i == 0 ? 0 : stored));
  if (pointers.back() != stored)
    words.fail(fmt::format("row pointers end at {}, not at {}", pointers.back(), stored));
  std::vector<int> columns;
  for (int i = 0; i < stored; ++i) columns.push_back(words.integer("a block column", 0, block_columns - 1));
  std::vector<int> row_of_column(static_cast<std::size_t>(block_columns), -1);
  for (int row = 0; row < block_rows; ++row) {
    for (int i = pointers[static_cast<std::size_t>(row)]; i < pointers[static_cast<std::size_t>(row) + 1];
         ++i) {
      words.integer("the number of a block", i, i);
      const auto column = static_cast<std::size_t>(columns[static_cast<std::size_t>(i)]);
      if (std::exchange(row_of_column[column], row) == row)
        words.fail(fmt::format("block {}, {} is stored twice", row, column));
      for (int c = column_ends[column]; c < column_ends[column + 1]; ++c) {
        for (int r = row_ends[static_cast<std::size_t>(row)]; r < row_ends[static_cast<std::size_t>(row) + 1];
             ++r) {
          if (const double value = words.real("a value of the matrix"); value != 0)
            values.emplace_back(r, c, value);
        }
      }
    }
  }
}

FrozenProblem parse_siconos(std::string_view text, const std::string& what) {
  Words words(text, what);
  words.integer("the dimension", dimension, dimension);
  const int contacts = words.integer("the number of contacts", 1, most_contacts);
  const int size = dimension * contacts;
  Triplets values;
  const int storage = words.integer("the storage of the matrix (0: dense, 1: blocks)", 0, 1);
  words.integer("the number of rows", size, size);
  words.integer("the number of columns", size, size);
  storage == 0 ? read_dense(words, size, values) : read_blocks(words, size, values);
  FrozenProblem problem;
  problem.matrix.resize(size, size);
  problem.matrix.setFromTriplets(values.begin(), values.end());
  for (int i = 0; i < size; ++i) {
    Mlcp::Row row{-1, -1, Vector6::Zero(), Vector6::Zero(), -words.real("a value of q"), 0, infinite, 0};
    if (i % dimension != 0) row.normal = i - i % dimension;
    problem.mlcp.rows.push_back(row);
  }
  for (int i = 0; i < contacts; ++i) {
    const double friction = words.real("a coefficient of friction");
    if (friction < 0) words.fail(fmt::format("a coefficient of friction is {}: below 0", friction));
    for (int k = 1; k < dimension; ++k)
      problem.mlcp.rows[static_cast<std::size_t>(dimension * i + k)].friction = friction;
  }
  // Siconos' own files may end with a flag.
  if (!words.is_at_end()) words.integer("the flag after the coefficients of friction", 0, 1);
  if (!words.is_at_end()) words.fail("more follows after the coefficients of friction");
  return problem;
}

FrozenProblem with_matrix(Mlcp mlcp) {
  std::vector<std::vector<int>> rows_of(static_cast<std::size_t>(mlcp.bodies));
  const auto part = [&](int row, int body) -> Vector6 {
    const Mlcp::Row& r = mlcp.rows[static_cast<std::size_t>(row)];
    return (r.a == body ? r.part_a : Vector6::Zero()) + (r.b == body ? r.part_b : Vector6::Zero());
  };
  Triplets values;
  const auto count = static_cast<int>(mlcp.rows.size());
  for (int i = 0; i < count; ++i) {
    const Mlcp::Row& row = mlcp.rows[static_cast<std::size_t>(i)];
    if (row.softness > 0) values.emplace_back(i, i, row.softness);
    for (const int body : {row.a, row.b}) {
      if (body < 0 || (body == row.b && row.a == row.b && !rows_of[static_cast<std::size_t>(body)].empty() &&
                       rows_of[static_cast<std::size_t>(body)].back() == i))
        continue;
      rows_of[static_cast<std::size_t>(body)].push_back(i);
    }
  }
  for (int body = 0; body < mlcp.bodies; ++body) {
    for (const int i : rows_of[static_cast<std::size_t>(body)]) {
      for (const int j : rows_of[static_cast<std::size_t>(body)])
        values.emplace_back(i, j, part(i, body).dot(part(j, body)));
    }
  }
  FrozenProblem problem{std::move(mlcp), SparseMatrix(count, count), true};
  problem.matrix.setFromTriplets(values.begin(), values.end());
  return problem;
}

/// Returns true where rows i and i + 1 are the tangents of one contact.
bool are_tangents(const Mlcp& mlcp, std::size_t i) {
  return i + 1 < mlcp.rows.size() && mlcp.rows[i].normal >= 0 &&
         mlcp.rows[i + 1].normal == mlcp.rows[i].normal && mlcp.rows[i + 1].friction == mlcp.rows[i].friction;
}

/// The point of the cone |x_t| <= μ x_n that is nearest to x.
Vector3 onto_cone(const Vector3& x, double friction) {
  const double slip = x.tail<2>().norm();
  if (slip <= friction * x[0]) return x;
  if (friction * slip <= -x[0]) return Vector3::Zero();
  const double normal = (x[0] + friction * slip) / (1 + friction * friction);
  const double factor = friction * normal / slip;
  return {normal, factor * x[1], factor * x[2]};
}

}  // namespace

int FrozenProblem::contacts() const {
  int count = 0;
  for (std::size_t i = 0; i < mlcp.rows.size(); ++i) count += are_tangents(mlcp, i) ? 1 : 0;
  return count;
}

double FrozenProblem::asymmetry() const {
  const SparseMatrix difference = matrix - SparseMatrix(matrix.transpose());
  const auto largest = [](const SparseMatrix& m) {
    return m.nonZeros() == 0
               ? 0
               : Eigen::Map<const Eigen::VectorXd>(m.valuePtr(), m.nonZeros()).cwiseAbs().maxCoeff();
  };
  const double scale = largest(matrix);
  return scale > 0 ? largest(difference) / scale : 0;
}

FrozenProblem parse_frozen_problem(std::string_view text, const std::string& what) {
  return text.starts_with("substep") ? with_matrix(parse_mlcp(text, what)) : parse_siconos(text, what);
}

std::string to_siconos_text(const FrozenProblem& problem) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  std::vector<std::array<int, dimension>> row_of;  // by contact and component; −1: the row is missing
  std::vector<std::pair<int, int>> component_of;   // by row
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<int>(i);
    const bool is_normal = rows[i].normal < 0 && rows[i].low == 0 && rows[i].high == infinite;
    const bool are_friction =
        are_tangents(problem.mlcp, i) && !row_of.empty() && row_of.back()[0] == rows[i].normal;
    if (!is_normal && !are_friction)
      throw Error(
          fmt::format("row {}: is neither a contact's normal nor the first of its two tangents", i + 1));
    const auto contact = static_cast<int>(row_of.size());
    if (is_normal) {
      row_of.push_back({row, -1, -1});
      component_of.emplace_back(contact, 0);
    } else {
      row_of.back() = {row_of.back()[0], row, row + 1};
      component_of.emplace_back(contact - 1, 1);
      component_of.emplace_back(contact - 1, 2);
      ++i;
    }
  }
  const auto contacts = static_cast<int>(row_of.size());
  std::vector<std::vector<std::pair<int, Matrix3>>> blocks(
      row_of.size());  // by contact, in ascending columns
  for (int row = 0; row < contacts; ++row) {
    for (int column = 0; column < contacts; ++column) {
      Matrix3 block = Matrix3::Zero();
      for (int r = 0; r < dimension; ++r) {
        for (int c = 0; c < dimension; ++c) {
          const int i = row_of[static_cast<std::size_t>(row)][static_cast<std::size_t>(r)];
          const int j = row_of[static_cast<std::size_t>(column)][static_cast<std::size_t>(c)];
          if (i >= 0 && j >= 0) block(r, c) = problem.matrix.coeff(i, j);
        }
      }
      if (!block.isZero(0)) blocks[static_cast<std::size_t>(row)].emplace_back(column, block);
    }
  }
  std::string ends;
  std::string pointers = "0";
  std::string columns;
  std::string values;
  std::size_t stored = 0;
  for (std::size_t row = 0; row < blocks.size(); ++row) {
    ends += fmt::format("{} ", dimension * (row + 1));
    for (const auto& [column, block] : blocks[row]) {
      columns += fmt::format("{} ", column);
      values += fmt::format("{}\n", stored++);
      for (const double value : block.reshaped()) values += fmt::format("{}\n", value);
    }
    pointers += fmt::format(" {}", stored);
  }
  std::string right;
  std::string friction;
  for (const auto& contact : row_of) {
    for (const int row : contact)
      right += fmt::format("{} ", row < 0 ? 0 : -rows[static_cast<std::size_t>(row)].right);
    friction += fmt::format("{} ", contact[1] < 0 ? 0 : rows[static_cast<std::size_t>(contact[1])].friction);
  }
  const int size = dimension * contacts;
  return fmt::format("{}\n{}\n1\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}{}\n{}\n", dimension, contacts,
                     size, size, stored, contacts, contacts, ends, ends, contacts + 1, stored, pointers,
                     columns, values, right, friction);
}

ConeError cone_error(const FrozenProblem& problem, const std::vector<double>& lambda) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  const auto count = static_cast<Eigen::Index>(rows.size());
  const Eigen::Map<const Eigen::VectorXd> impulses(lambda.data(), count);
  Eigen::VectorXd right(count);
  for (Eigen::Index i = 0; i < count; ++i) right[i] = rows[static_cast<std::size_t>(i)].right;
  const Eigen::VectorXd velocity = problem.matrix * impulses - right;
  std::vector<bool> has_cone(rows.size(), false);
  double squared = 0;
  double most_power = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!are_tangents(problem.mlcp, i)) continue;
    const Eigen::Index normal = rows[i].normal;
    const auto first = static_cast<Eigen::Index>(i);
    const Vector3 impulse(impulses[normal], impulses[first], impulses[first + 1]);
    Vector3 u(velocity[normal], velocity[first], velocity[first + 1]);
    u[0] += rows[i].friction * u.tail<2>().norm();
    squared += (impulse - onto_cone(impulse - u, rows[i].friction)).squaredNorm();
    most_power = std::max(most_power, std::abs(impulse.dot(u)));
    has_cone[static_cast<std::size_t>(normal)] = has_cone[i] = has_cone[i + 1] = true;
    ++i;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (has_cone[i]) continue;
    const double most =
        rows[i].normal < 0
            ? rows[i].high
            : rows[i].friction * std::max(0.0, lambda[static_cast<std::size_t>(rows[i].normal)]);
    const double least = rows[i].normal < 0 ? rows[i].low : -most;
    const double wrong =
        lambda[i] - std::clamp(lambda[i] - velocity[static_cast<Eigen::Index>(i)], least, most);
    squared += wrong * wrong;
  }
  const double scale = std::max({right.norm(), impulses.norm(), velocity.norm()});
  if (!(scale > 0)) return {};
  return {std::sqrt(squared) / scale, most_power / (scale * scale)};
}

MlcpReport solve(const FrozenProblem& problem, std::vector<double>& lambda) {
  if (problem.has_bodies) return DirectSolver().solve(problem.mlcp, lambda);
  return MlcpMatrixSolver(problem.matrix).solve(problem.mlcp, lambda);
}

void sweep_rows(const FrozenProblem& problem, std::vector<double>& lambda, int sweeps) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  lambda.resize(rows.size(), 0.0);
  const SparseMatrix& matrix = problem.matrix;
  Eigen::VectorXd velocity = matrix * Eigen::Map<const Eigen::VectorXd>(lambda.data(), matrix.cols());
  const auto take = [&](std::size_t i, double total) {
    for (SparseMatrix::InnerIterator entry(matrix, static_cast<Eigen::Index>(i)); entry; ++entry)
      velocity[entry.row()] += entry.value() * (total - lambda[i]);
    lambda[i] = total;
  };
  const auto missing = [&](std::size_t i) { return rows[i].right - velocity[static_cast<Eigen::Index>(i)]; };
  const auto diagonal = [&](std::size_t i) { return matrix.coeff(static_cast<int>(i), static_cast<int>(i)); };
  for (int s = 0; s < sweeps; ++s) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!(diagonal(i) > 0)) continue;
      const double most =
          rows[i].normal < 0
              ? rows[i].high
              : rows[i].friction * std::max(0.0, lambda[static_cast<std::size_t>(rows[i].normal)]);
      if (!are_tangents(problem.mlcp, i)) {
        take(i, std::clamp(lambda[i] + missing(i) / diagonal(i), rows[i].normal < 0 ? rows[i].low : -most,
                           most));
        continue;
      }
      const auto first = static_cast<int>(i);
      const double between = (matrix.coeff(first, first + 1) + matrix.coeff(first + 1, first)) / 2;
      const Eigen::Matrix2d block{{diagonal(i), between}, {between, diagonal(i + 1)}};
      const Vector2 before(lambda[i], lambda[i + 1]);
      const Vector2 lacks(missing(i), missing(i + 1));
      Vector2 total = before + block.inverse() * lacks;
      if (!(total.norm() <= most)) {
        const double half = (block(0, 0) - block(1, 1)) / 2;
        const double largest = (block(0, 0) + block(1, 1)) / 2 + std::sqrt(half * half + between * between);
        total = before + lacks / largest;
        total *= total.norm() > 0 ? most / total.norm() : 0;
      }
      take(i, total.x());
      take(i + 1, total.y());
      ++i;
    }
  }
}

}  // namespace substep
