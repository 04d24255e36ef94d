#include "sim/direct/block_factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace substep {
namespace {

/// Inverts a symmetric matrix. Returns false where a pivot is at most `least` times its element of `whole`.
bool invert(const Matrix3& matrix, const Vector3& whole, double least, Matrix3& inverse) {
  const double d0 = matrix(0, 0);
  if (!(d0 > least * whole[0])) return false;
  const double i0 = 1 / d0;
  const double l10 = matrix(1, 0) * i0;
  const double l20 = matrix(2, 0) * i0;
  const double d1 = matrix(1, 1) - l10 * matrix(1, 0);
  if (!(d1 > least * whole[1])) return false;
  const double i1 = 1 / d1;
  const double a21 = matrix(2, 1) - l20 * matrix(1, 0);
  const double l21 = a21 * i1;
  const double d2 = matrix(2, 2) - l20 * matrix(2, 0) - l21 * a21;
  if (!(d2 > least * whole[2])) return false;
  const double i2 = 1 / d2;
  // L⁻¹ has −l10, −l21 and m20 below its diagonal; the inverse is L⁻ᵀ D⁻¹ L⁻¹.
  const double m20 = l10 * l21 - l20;
  inverse(0, 0) = i0 + l10 * l10 * i1 + m20 * m20 * i2;
  inverse(0, 1) = inverse(1, 0) = -l10 * i1 - m20 * l21 * i2;
  inverse(0, 2) = inverse(2, 0) = m20 * i2;
  inverse(1, 1) = i1 + l21 * l21 * i2;
  inverse(1, 2) = inverse(2, 1) = -l21 * i2;
  inverse(2, 2) = i2;
  return true;
}

/// Returns the positions in the order of elimination, by index.
std::vector<int> order_of(int count, const std::vector<std::pair<int, int>>& pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < count; ++i) entries.emplace_back(i, i, 1);
  for (const auto& [a, b] : pairs) {
    entries.emplace_back(a, b, 1);
    entries.emplace_back(b, a, 1);
  }
  Eigen::SparseMatrix<double> pattern(count, count);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);
  std::vector<int> positions(count);
  for (int position = 0; position < count; ++position) positions[order.indices()[position]] = position;
  return positions;
}

}  // namespace

void BlockFactor::analyse(int count, std::vector<std::pair<int, int>>& pairs) {
  position_ = order_of(count, pairs);
  index_.resize(count);
  for (int i = 0; i < count; ++i) index_[position_[i]] = i;

  // Find the fill: a column has its own rows, and the other rows of earlier columns whose first row it is.
  std::vector<std::vector<int>> rows(count);
  for (auto& [row, column] : pairs) {
    if (position_[row] < position_[column]) std::swap(row, column);
    rows[position_[column]].push_back(position_[row]);
  }
  begin_.assign(1, 0);
  row_.clear();
  for (int p = 0; p < count; ++p) {
    std::vector<int>& own = rows[p];
    std::ranges::sort(own);
    own.erase(std::unique(own.begin(), own.end()), own.end());
    row_.insert(row_.end(), own.begin(), own.end());
    begin_.push_back(static_cast<int>(row_.size()));
    if (!own.empty()) rows[own.front()].insert(rows[own.front()].end(), own.begin() + 1, own.end());
    own = {};
  }
  const auto edge_of = [&](int early, int late) {
    const auto begin = row_.begin() + begin_[early];
    return static_cast<int>(std::lower_bound(begin, row_.begin() + begin_[early + 1], late) - row_.begin());
  };
  edge_of_pair_.clear();
  for (const auto& [row, column] : pairs) edge_of_pair_.push_back(edge_of(position_[column], position_[row]));
  targets_.clear();
  std::size_t widest = 0;
  for (int p = 0; p < count; ++p) {
    widest = std::max(widest, static_cast<std::size_t>(begin_[p + 1] - begin_[p]));
    for (int i = begin_[p]; i < begin_[p + 1]; ++i) {
      for (int j = begin_[p]; j < i; ++j) targets_.push_back(edge_of(row_[j], row_[i]));
    }
  }
  diagonal_.resize(count);
  inverse_.resize(count);
  lower_.resize(row_.size());
  column_.resize(widest);
  right_.resize(count);
}

void BlockFactor::clear() {
  std::ranges::fill(diagonal_, Matrix3::Zero());
  std::ranges::fill(lower_, Matrix3::Zero());
}

bool BlockFactor::factor(double least) {
  const int count = static_cast<int>(index_.size());
  for (int p = 0; p < count; ++p) right_[p] = diagonal_[p].diagonal();  // judges pivots
  const int* target = targets_.data();
  for (int p = 0; p < count; ++p) {
    if (!invert(diagonal_[p], right_[p], least, inverse_[p])) return false;
    const int begin = begin_[p];
    const int end = begin_[p + 1];
    for (int i = begin; i < end; ++i) {
      column_[i - begin] = lower_[i];
      lower_[i].noalias() = column_[i - begin] * inverse_[p];  // L = A D⁻¹
      for (int j = begin; j < i; ++j)
        lower_[*target++].noalias() -= lower_[i] * column_[j - begin].transpose();
      diagonal_[row_[i]].noalias() -= lower_[i] * column_[i - begin].transpose();
    }
  }
  return true;
}

void BlockFactor::solve(std::vector<Vector3>& x) {
  const int count = static_cast<int>(index_.size());
  for (int p = 0; p < count; ++p) right_[p] = x[index_[p]];
  for (int p = 0; p < count; ++p) {  // L y = b
    for (int i = begin_[p]; i < begin_[p + 1]; ++i) right_[row_[i]].noalias() -= lower_[i] * right_[p];
  }
  for (int p = count - 1; p >= 0; --p) {  // D Lᵀ x = y
    Vector3 sum = inverse_[p] * right_[p];
    for (int i = begin_[p]; i < begin_[p + 1]; ++i) sum.noalias() -= lower_[i].transpose() * right_[row_[i]];
    right_[p] = sum;
    x[index_[p]] = sum;
  }
}

}  // namespace substep
