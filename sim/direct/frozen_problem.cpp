// Reads and writes frozen problems as text, in the formats of substep and Siconos.

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "sim/direct/frozen_problem.h"
#include "sim/error.h"

namespace substep {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr int dimension = 3;
constexpr int most_contacts = 1000;
constexpr int most_bodies = 1000000;

/// A reader of a text word by word, with the line of the last word.
class Words {
 public:
  Words(std::string_view text, const std::string& what) : rest_(text), what_(what) {}

  [[noreturn]] void fail(const std::string& trouble) const {
    throw Error("{}:{}: {}", what_, line_, trouble);
  }

  bool is_at_end() {
    while (!rest_.empty() && is_space(rest_.front())) skip();
    return rest_.empty();
  }

  /// Skips a word that has to be `expected`.
  void skip(std::string_view expected, const char* trouble) {
    if (next(expected) != expected) fail(trouble);
  }

  /// Reads a number; `name` describes it in messages.
  int integer(std::string_view name, int low, int high) {
    const int value = number<int>(name);
    if (value < low || value > high) fail(fmt::format("{} is {}: expected {} to {}", name, value, low, high));
    return value;
  }

  double real(std::string_view name, double low = -std::numeric_limits<double>::max()) {
    const double value = limit(name);
    if (!std::isfinite(value)) fail(fmt::format("{} is not finite", name));
    if (value < low) fail(fmt::format("{} is {}: below {}", name, value, low));
    return value;
  }

  /// Reads a number that may be infinite.
  double limit(std::string_view name) { return number<double>(name); }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

  void skip() {
    if (rest_.front() == '\n') ++line_;
    rest_.remove_prefix(1);
  }

  std::string_view next(std::string_view name) {
    if (is_at_end()) fail(fmt::format("the file ends before {}", name));
    std::size_t length = 0;
    while (length < rest_.size() && !is_space(rest_[length])) ++length;
    const std::string_view word = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return word;
  }

  template <typename Number>
  Number number(std::string_view name) {
    std::string_view word = next(name);
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

/// Reads the ends of block rows, or of block columns. Returns a 0 and the ends.
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
  std::vector<int> row_of_column(block_columns, -1);
  for (int row = 0; row < block_rows; ++row) {
    for (int i = pointers[row]; i < pointers[row + 1]; ++i) {
      words.integer("the number of a block", i, i);
      const int column = columns[i];
      if (std::exchange(row_of_column[column], row) == row)
        words.fail(fmt::format("block {}, {} is stored twice", row, column));
      for (int c = column_ends[column]; c < column_ends[column + 1]; ++c) {
        for (int r = row_ends[row]; r < row_ends[row + 1]; ++r) {
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
    Mlcp::Row row{-1, -1, Vector6::Zero(), Vector6::Zero(), -words.real("a value of q"), 0, infinity, 0};
    if (i % dimension != 0) row.normal = i - i % dimension;
    problem.mlcp.rows.push_back(row);
  }
  for (int i = 0; i < contacts; ++i) {
    const double friction = words.real("a coefficient of friction", 0);
    for (int k = 1; k < dimension; ++k) problem.mlcp.rows[dimension * i + k].friction = friction;
  }
  // Accept a flag at the end, as in Siconos' own files.
  if (!words.is_at_end()) words.integer("the flag after the coefficients of friction", 0, 1);
  if (!words.is_at_end()) words.fail("more follows after the coefficients of friction");
  return problem;
}

/// Returns the problem with its matrix Γ + S.
FrozenProblem with_matrix(Mlcp mlcp) {
  std::vector<std::vector<int>> rows_of(mlcp.bodies);
  const auto part = [&](int row, int body) -> Vector6 {
    const Mlcp::Row& r = mlcp.rows[row];
    return (r.a == body ? r.part_a : Vector6::Zero()) + (r.b == body ? r.part_b : Vector6::Zero());
  };
  Triplets values;
  const auto count = static_cast<int>(mlcp.rows.size());
  for (int i = 0; i < count; ++i) {
    const Mlcp::Row& row = mlcp.rows[i];
    if (row.softness > 0) values.emplace_back(i, i, row.softness);
    if (row.a >= 0) rows_of[row.a].push_back(i);
    if (row.b >= 0 && row.b != row.a) rows_of[row.b].push_back(i);
  }
  for (int body = 0; body < mlcp.bodies; ++body) {
    for (const int i : rows_of[body]) {
      for (const int j : rows_of[body]) values.emplace_back(i, j, part(i, body).dot(part(j, body)));
    }
  }
  FrozenProblem problem{std::move(mlcp), Eigen::SparseMatrix<double>(count, count), true};
  problem.matrix.setFromTriplets(values.begin(), values.end());
  return problem;
}

/// Returns the rows of each contact: its normal, and its two tangents or −1.
std::vector<std::array<int, dimension>> rows_of_contacts(const Mlcp& mlcp) {
  std::vector<std::array<int, dimension>> contacts;
  for (int i = 0; i < static_cast<int>(mlcp.rows.size()); ++i) {
    const Mlcp::Row& row = mlcp.rows[i];
    if (row.normal < 0 && row.low == 0 && row.high == infinity) {
      contacts.push_back({i, -1, -1});
    } else if (are_tangents(mlcp, i) && !contacts.empty() && contacts.back()[0] == row.normal) {
      contacts.back() = {row.normal, i, i + 1};
      ++i;
    } else {
      throw Error("row {}: is neither a contact's normal nor the first of its two tangents", i + 1);
    }
  }
  return contacts;
}

}  // namespace

bool are_tangents(const Mlcp& mlcp, std::size_t i) {
  return i + 1 < mlcp.rows.size() && mlcp.rows[i].normal >= 0 &&
         mlcp.rows[i + 1].normal == mlcp.rows[i].normal && mlcp.rows[i + 1].friction == mlcp.rows[i].friction;
}

std::string to_text(const Mlcp& problem) {
  std::string text = fmt::format("substep mlcp 1\nbodies {}\nrows {}\n", problem.bodies, problem.rows.size());
  for (const Mlcp::Row& row : problem.rows) {
    text += fmt::format("row {} {} {} {} {} {} {} {}", row.a, row.b, row.right, row.low, row.high,
                        row.softness, row.normal, row.friction);
    for (const Vector6& part : {row.part_a, row.part_b}) {
      for (const double value : part) text += fmt::format(" {}", value);
    }
    text += '\n';
  }
  return text;
}

Mlcp parse_mlcp(std::string_view text, const std::string& what) {
  Words words(text, what);
  constexpr int most = std::numeric_limits<int>::max();
  for (const char* const word : {"substep", "mlcp", "1"})
    words.skip(word, "another format than 'substep mlcp 1'");
  Mlcp problem;
  words.skip("bodies", "expected 'bodies'");
  problem.bodies = words.integer("the number of bodies", 0, most_bodies);
  words.skip("rows", "expected 'rows'");
  const int rows = words.integer("the number of rows", 0, most);
  for (int i = 0; i < rows; ++i) {
    words.skip("row", "expected 'row'");
    Mlcp::Row row{};
    row.a = words.integer("body a", -1, problem.bodies - 1);
    row.b = words.integer("body b", -1, problem.bodies - 1);
    row.right = words.real("a right side");
    row.low = words.limit("a lower limit");
    row.high = words.limit("an upper limit");
    if (!(row.low <= row.high)) words.fail("a lower limit is above its upper one");
    row.softness = words.real("a softness", 0);
    row.normal = words.integer("the row of a normal", -1, i - 1);
    row.friction = words.real("a coefficient of friction", 0);
    for (double& value : row.part_a) value = words.real("a value of body a");
    for (double& value : row.part_b) value = words.real("a value of body b");
    problem.rows.push_back(row);
  }
  if (!words.is_at_end()) words.fail("more follows after the rows");
  return problem;
}

FrozenProblem parse_frozen_problem(std::string_view text, const std::string& what) {
  return text.starts_with("substep") ? with_matrix(parse_mlcp(text, what)) : parse_siconos(text, what);
}

std::string to_siconos_text(const FrozenProblem& problem) {
  const std::vector<Mlcp::Row>& rows = problem.mlcp.rows;
  const auto contacts = rows_of_contacts(problem.mlcp);
  std::string ends;
  std::string pointers = "0";
  std::string columns;
  std::string values;
  std::string right;
  std::string friction;
  int stored = 0;
  for (std::size_t row = 0; row < contacts.size(); ++row) {
    ends += fmt::format("{} ", dimension * (row + 1));
    for (std::size_t column = 0; column < contacts.size(); ++column) {
      Matrix3 block = Matrix3::Zero();
      for (int k = 0; k < 9; ++k) {
        const int i = contacts[row][k / 3];
        const int j = contacts[column][k % 3];
        if (i >= 0 && j >= 0) block(k / 3, k % 3) = problem.matrix.coeff(i, j);
      }
      if (block.isZero(0)) continue;
      columns += fmt::format("{} ", column);
      values += fmt::format("{}\n", stored++);
      for (const double value : block.reshaped()) values += fmt::format("{}\n", value);
    }
    pointers += fmt::format(" {}", stored);
    for (const int i : contacts[row]) right += fmt::format("{} ", i < 0 ? 0 : -rows[i].right);
    friction += fmt::format("{} ", contacts[row][1] < 0 ? 0 : rows[contacts[row][1]].friction);
  }
  const std::size_t count = contacts.size();
  const std::size_t size = dimension * count;
  return fmt::format("{}\n{}\n1\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}{}\n{}\n", dimension, count,
                     size, size, stored, count, count, ends, ends, count + 1, stored, pointers, columns,
                     values, right, friction);
}

}  // namespace substep
