#include "sim/loading/body_inertia.h"

#include <cmath>

namespace substep {

PrincipalInertia symmetric_principal_inertia(Matrix3 inertia) {
  constexpr double rounding = 1e-12;
  const double largest = inertia.diagonal().cwiseAbs().maxCoeff();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (row != column && std::fabs(inertia(row, column)) <= rounding * largest) inertia(row, column) = 0;
    }
  }
  PrincipalInertia principal = principal_inertia(inertia);
  Vector3& moments = principal.moments;
  const auto equal = [&](int i, int j) { return std::fabs(moments[i] - moments[j]) <= rounding * largest; };
  if (equal(0, 1)) moments[1] = moments[0];
  if (equal(0, 2)) moments[2] = moments[0];
  if (equal(1, 2)) moments[2] = moments[1];
  return principal;
}

}  // namespace substep
