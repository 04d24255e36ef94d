#include "golden/compare/distance_matrix.h"

#include <algorithm>
#include <cmath>

namespace substep {

double run_distance(const PoseLog& a, const PoseLog& b) {
  double sum = 0;
  std::int64_t count = 0;
  for (std::size_t k = 0; k < std::min(a.frames.size(), b.frames.size()); ++k) {
    const auto& p = a.frames[k].poses;
    const auto& q = b.frames[k].poses;
    if (p.empty() || q.empty()) continue;
    if (p.size() != q.size()) return -1;
    for (std::size_t body = 1; body < p.size(); ++body)
      sum += (p[body].linear - q[body].linear).squaredNorm();
    count += static_cast<std::int64_t>(p.size()) - 1;
  }
  return count == 0 ? -1 : std::sqrt(sum / static_cast<double>(count));
}

std::vector<double> run_distances(std::span<const PoseLog* const> logs) {
  std::vector<double> result;
  for (const PoseLog* row : logs) {
    for (const PoseLog* column : logs) {
      const bool both = row != nullptr && column != nullptr;
      result.push_back(both ? (row == column ? 0 : run_distance(*row, *column)) : -1);
    }
  }
  return result;
}

}  // namespace substep
