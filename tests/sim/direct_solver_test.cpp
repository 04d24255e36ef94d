// The joints solver against the general one, on joint graphs of each shape.

#include "sim/direct/direct_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/simulation.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using Links = std::vector<std::pair<int, int>>;

/// Three rows of any direction for each link; body −1 does not move.
Mlcp joints_between(const Links& links, int bodies, double softness) {
  std::mt19937 random(7);
  const auto any = [&random] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  Mlcp problem;
  problem.bodies = bodies;
  for (const auto& [a, b] : links) {
    for (int k = 0; k < 3; ++k) {
      Mlcp::Row row{};
      row.a = a;
      row.b = b;
      for (double& value : row.part_a) value = any();
      for (double& value : row.part_b) value = b >= 0 ? any() : 0;
      row.right = any();
      row.low = -INFINITY;
      row.high = INFINITY;
      row.softness = softness;
      problem.rows.push_back(row);
    }
  }
  return problem;
}

double largest_difference(const Mlcp& problem) {
  JointSolver joints;
  std::vector<double> lambda;
  MlcpReport report;
  EXPECT_TRUE(joints.solve(problem, lambda, report));
  EXPECT_LT(report.residual, 1e-13);  // measured at most 2e-15
  std::vector<double> expected;
  MlcpSolver general;
  general.solve(problem, expected);
  double largest = 0;
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    largest = std::max(largest, std::abs(lambda[i] - expected[i]));
  }
  return largest;
}

TEST(JointSolver, SolvesChainsTreesRingsAndSeparateParts) {
  const Links chain = {{0, -1}, {1, 0}, {2, 1}, {3, 2}, {4, 3}, {5, 4}};
  const Links tree = {{0, -1}, {1, 0}, {2, 0}, {3, 1}, {4, 1}, {5, 2}};
  const Links ring = {{0, 3}, {1, 0}, {5, 4}, {3, 2}, {4, 3}, {2, 5}, {2, 1}};
  const Links parts = {{4, 5}, {0, 1}, {2, -1}, {3, 2}};
  for (const Links& links : {chain, tree, ring, parts}) {
    EXPECT_LT(largest_difference(joints_between(links, 6, 0)), 1e-9);     // measured 6e-12
    EXPECT_LT(largest_difference(joints_between(links, 6, 0.5)), 1e-10);  // measured 2e-14
  }
}

TEST(JointSolver, FollowsChangedPattern) {
  JointSolver solver;
  std::vector<double> lambda;
  for (const Links& links : {Links{{0, -1}, {1, 0}}, Links{{1, -1}, {0, 1}}, Links{{0, 1}}}) {
    MlcpReport report;
    ASSERT_TRUE(solver.solve(joints_between(links, 2, 0), lambda, report));
    EXPECT_LT(report.residual, 1e-13);  // measured 5e-16
  }
}

TEST(JointSolver, LeavesRestToGeneralSolver) {
  JointSolver solver;
  std::vector<double> lambda;
  MlcpReport report;
  Mlcp twice = joints_between({{0, -1}, {1, 0}}, 2, 0);
  const std::vector<Mlcp::Row> rows = twice.rows;
  twice.rows.insert(twice.rows.end(), rows.begin(), rows.end());  // Γ is singular
  EXPECT_FALSE(solver.solve(twice, lambda, report));
  Mlcp limited = joints_between({{0, -1}}, 1, 0);
  limited.rows[1].low = 0;
  EXPECT_FALSE(solver.solve(limited, lambda, report));

  const MlcpReport general = DirectSolver().solve(twice, lambda);
  EXPECT_EQ(general.status, MlcpReport::Status::solved);
  EXPECT_LT(general.residual, MlcpSolver::tolerance);  // measured 1e-13
}

TEST(JointSolver, SolvesRandomLoopsAsTheGeneralSolver) {
  // Links in any order, some twice: λ is not unique, Gᵀλ is.
  std::mt19937 random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const int bodies = 4 + 2 * trial;
    Links links = {{0, -1}};
    for (int i = 1; i < bodies; ++i) links.emplace_back(i, static_cast<int>(random() % i));
    for (int i = 0; i < bodies / 3; ++i) links.push_back(links[random() % links.size()]);
    Mlcp problem = joints_between(links, bodies, trial % 2 == 0 ? 0 : 0.3);
    // Some velocity of the bodies fulfils all.
    for (Mlcp::Row& row : problem.rows) row.right = row.part_a.sum() + (row.b >= 0 ? row.part_b.sum() : 0);
    JointSolver joints;
    std::vector<double> lambda;
    MlcpReport report;
    ASSERT_TRUE(joints.solve(problem, lambda, report)) << trial;
    EXPECT_LT(report.residual, 1e-11) << trial;  // measured at most 1e-12
    std::vector<double> expected;
    MlcpSolver general;
    general.solve(problem, expected);
    double difference = 0;
    for (int body = 0; body < bodies; ++body)
      difference = std::max(difference, (joints.impulses()[body] - general.impulses()[body]).norm());
    EXPECT_LT(difference, 1e-7) << trial;
  }
}

TEST(JointSolver, HangsNets) {
  // It hangs from five balls of an edge. In the first second its rows are nearly redundant: it is flat.
  Settings settings;
  settings.algorithm = Algorithm::a1;
  const Scene scene = test::net(20);
  Simulation simulation(scene, settings);
  for (int i = 0; i < 60; ++i) {
    const StepReport& report = simulation.step();
    EXPECT_NE(report.status, StepReport::Status::unsolved) << i;
    EXPECT_NE(report.status, StepReport::Status::diverged) << i;
  }
}

TEST(JointSolver, HasNoImpulsesWithoutRows) {
  Mlcp problem;
  problem.bodies = 2;
  std::vector<double> lambda{1, 2, 3};  // of the step before
  MlcpReport report;
  EXPECT_TRUE(JointSolver().solve(problem, lambda, report));
  EXPECT_TRUE(lambda.empty());
}

TEST(JointSolver, SolvesLongChain) {
  // λᵀΓλ is (π/N)² of λᵀDλ there, without any redundancy.
  Settings settings;
  settings.algorithm = Algorithm::a1;
  Simulation simulation(test::chain(10000), settings);
  for (int i = 0; i < 3; ++i) {
    const StepReport& report = simulation.step();
    EXPECT_EQ(report.status, StepReport::Status::ok);
    EXPECT_EQ(report.active_sets, 1);
    EXPECT_LT(report.residual, 1e-12);  // measured 5e-14
  }
}

}  // namespace
}  // namespace substep
