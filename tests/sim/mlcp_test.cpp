#include "sim/mlcp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace substep {
namespace {

double uniform(std::mt19937& random) {
  return static_cast<double>(random()) / 4294967296.0 * 2 - 1;
}

Vector6 any_part(std::mt19937& random) {
  Vector6 part;
  for (double& value : part) value = uniform(random);
  return part;
}

Mlcp::Row any_row(std::mt19937& random, int bodies) {
  Mlcp::Row row{};
  row.a = static_cast<int>(random() % bodies);
  row.b = static_cast<int>(random() % (bodies + 1)) - 1;
  if (row.b == row.a) row.b = -1;
  row.part_a = any_part(random);
  row.part_b = row.b >= 0 ? any_part(random) : Vector6::Zero();
  row.low = -INFINITY;
  row.high = INFINITY;
  return row;
}

/// Rows of each kind. `redundant`: some rows are repeated, scaled, with matching right sides, so that Γ is
/// singular but the problem has a solution.
Mlcp any_problem(std::mt19937& random, int bodies, int rows, bool redundant) {
  Mlcp problem;
  problem.bodies = bodies;
  std::vector<Vector6> velocity(bodies);
  for (Vector6& v : velocity) v = any_part(random);
  const auto reached = [&](const Mlcp::Row& row) {
    return row.part_a.dot(velocity[row.a]) + (row.b >= 0 ? row.part_b.dot(velocity[row.b]) : 0.0);
  };
  for (int i = 0; i < rows; ++i) {
    Mlcp::Row row = any_row(random, bodies);
    if (redundant && i > 0 && random() % 3 == 0) {
      row = problem.rows[random() % problem.rows.size()];
      const double factor = 0.5 + std::abs(uniform(random));
      row.part_a *= factor;
      row.part_b *= factor;
    }
    row.right = reached(row);
    switch (random() % 3) {
      case 0:
        row.low = -INFINITY;
        row.high = INFINITY;
        break;
      case 1:
        row.low = 0;
        row.high = INFINITY;
        break;
      default:
        row.low = -0.2;
        row.high = 0.3;
        break;
    }
    row.softness = random() % 5 == 0 ? 0.1 : 0;
    problem.rows.push_back(row);
  }
  return problem;
}

TEST(Mlcp, SolvesRandomProblemsToRounding) {
  std::mt19937 random(1);
  MlcpSolver solver;
  std::vector<double> lambda;
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    const int bodies = 1 + static_cast<int>(random() % 8);
    // Fewer two-sided rows than degrees of freedom, so that each problem has a solution.
    const Mlcp problem = any_problem(random, bodies, 1 + static_cast<int>(random() % (4 * bodies)), false);
    const MlcpReport report = solver.solve(problem, lambda);
    EXPECT_EQ(report.status, MlcpReport::Status::solved) << i << " residual " << report.residual;
    worst = std::max(worst, report.residual);
  }
  EXPECT_LE(worst, MlcpSolver::tolerance);
}

TEST(Mlcp, SolvesRedundantProblems) {
  std::mt19937 random(2);
  MlcpSolver solver;
  std::vector<double> lambda;
  for (int i = 0; i < 500; ++i) {
    const int bodies = 1 + static_cast<int>(random() % 6);
    const Mlcp problem = any_problem(random, bodies, 2 + static_cast<int>(random() % (8 * bodies)), true);
    const MlcpReport report = solver.solve(problem, lambda);
    EXPECT_EQ(report.status, MlcpReport::Status::solved) << i << " residual " << report.residual;
    for (const double value : lambda) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(Mlcp, SaysThatInconsistentRowsHaveNoSolution) {
  std::mt19937 random(3);
  Mlcp problem;
  problem.bodies = 1;
  Mlcp::Row row = any_row(random, 1);
  row.right = 1;
  problem.rows.push_back(row);
  row.right = 2;
  problem.rows.push_back(row);
  MlcpSolver solver;
  std::vector<double> lambda;
  const MlcpReport report = solver.solve(problem, lambda);
  EXPECT_EQ(report.status, MlcpReport::Status::unsolved);
  EXPECT_GT(report.residual, 1e-3);
  // The compromise: half-way between the two.
  const Vector6 y = lambda[0] * row.part_a + lambda[1] * row.part_a;
  EXPECT_NEAR(row.part_a.dot(y), 1.5, 1e-3);
}

TEST(Mlcp, CouplesFrictionToTheNormal) {
  // A point mass of 1 kg pressed on a plane by 1 N·s and pushed sideways.
  for (const double push : {0.2, 0.39, 0.41, 3.0}) {
    Mlcp problem;
    problem.bodies = 1;
    Mlcp::Row normal{};
    normal.a = 0;
    normal.b = -1;
    normal.part_a = Vector6::Unit(1);
    normal.part_b.setZero();
    normal.low = 0;
    normal.high = INFINITY;
    normal.right = 1;
    Mlcp::Row tangent = normal;
    tangent.part_a = Vector6::Unit(0);
    tangent.right = -push;
    tangent.normal = 0;
    tangent.friction = 0.4;
    problem.rows = {normal, tangent};
    MlcpSolver solver;
    std::vector<double> lambda;
    EXPECT_EQ(solver.solve(problem, lambda).status, MlcpReport::Status::solved);
    EXPECT_NEAR(lambda[0], 1, 1e-12);
    EXPECT_NEAR(lambda[1], -std::min(push, 0.4), 1e-12);
  }
}

TEST(Mlcp, RowsThatNothingMovesAreLeftAlone) {
  Mlcp problem;
  problem.bodies = 1;
  Mlcp::Row row{};
  row.a = -1;
  row.b = -1;
  row.part_a.setZero();
  row.part_b.setZero();
  row.low = -INFINITY;
  row.high = INFINITY;
  row.right = 1;
  problem.rows.push_back(row);
  MlcpSolver solver;
  std::vector<double> lambda;
  solver.solve(problem, lambda);
  EXPECT_EQ(lambda[0], 0);
}

}  // namespace
}  // namespace substep
