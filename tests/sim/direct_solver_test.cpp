// The joints solver against the general one, on joint graphs of each shape; friction problems in files:
// Siconos' text of our own dumped problems, A1's solver without bodies, and refusals.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/direct/direct_solver.h"
#include "sim/direct/frozen_problem.h"
#include "sim/error.h"
#include "sim/model/usual_settings.h"
#include "sim/simulation.h"
#include "tests/error_message.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

using Links = std::vector<std::pair<int, int>>;

/// Returns three rows of random direction for each link; body −1 does not move.
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
  for (std::size_t i = 0; i < lambda.size(); ++i)
    largest = std::max(largest, std::abs(lambda[i] - expected[i]));
  return largest;
}

TEST(JointSolver, SolvesChainsTreesAndRings) {
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

TEST(JointSolver, SolvesRandomLoopsLikeGeneralSolver) {
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
  // The net hangs from five balls of an edge. In the first second it is flat and its rows are nearly
  // redundant.
  Simulation simulation(test::net(20), {.algorithm = Algorithm::a1});
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
  Simulation simulation(test::chain(10000), {.algorithm = Algorithm::a1});
  for (int i = 0; i < 3; ++i) {
    const StepReport& report = simulation.step();
    EXPECT_EQ(report.status, StepReport::Status::ok);
    EXPECT_EQ(report.active_sets, 1);
    EXPECT_LT(report.residual, 1e-12);  // measured 5e-14
  }
}

/// Returns the problem of a step in which a pile of boxes slides: `boxes` in a row two deep, pushed at 1 m/s.
std::string dumped(int boxes, double friction) {
  Scene scene = test::floor_scene(friction);
  for (int i = 0; i < boxes; ++i) {
    const int box =
        test::add_box(scene, {1, 1, 1}, 1 + i % 3, test::at(0.7 * (i / 2), 0.5 + i % 2, 0.1 * i), friction);
    scene.bodies[box].linear_velocity = {1, 0, 0.3 * (i % 2)};
  }
  Simulation simulation(scene, default_settings(Algorithm::a1));
  simulation.step();
  return simulation.last_problem();
}

TEST(FrozenProblem, MatrixGivesTheBodiesSolution) {
  for (const double friction : {0.0, 0.3, 0.9}) {
    for (const int boxes : {1, 2, 7, 24}) {
      const FrozenProblem bodies = parse_frozen_problem(dumped(boxes, friction), "dumped");
      const std::string text = to_siconos_text(bodies);
      const FrozenProblem matrix = parse_frozen_problem(text, "siconos");
      EXPECT_EQ(to_siconos_text(matrix), text);
      EXPECT_EQ(matrix.contacts(), static_cast<int>(matrix.mlcp.rows.size()) / 3);
      for (const FrozenProblem* problem : {&bodies, &matrix}) {
        std::vector<double> lambda;
        EXPECT_EQ(solve(*problem, lambda).status, MlcpReport::Status::solved) << friction << ' ' << boxes;
        const ConeError error = cone_error(*problem, lambda);
        EXPECT_LT(error.natural_map, 1e-8) << friction << ' ' << boxes;  // measured at most 4e-13
        EXPECT_LT(error.complementarity, 1e-8);
      }
    }
  }
}

/// Returns a problem of one contact: W = diag(2, 1, 1), q, μ = 0.5.
std::string one_contact(const std::string& q, const std::string& matrix = "2 0 0\n0 1 0\n0 0 1") {
  return "3\n1\n0\n3\n3\n3 3\n" + matrix + "\n" + q + "\n0.5\n";
}

TEST(FrozenProblem, ProjectsErrorOntoCone) {
  const FrozenProblem problem = parse_frozen_problem(one_contact("-2 3 0"), "one");
  // r = (1, −0.5, 0) slides with u = (0, 2.5, 0).
  std::vector<double> lambda;
  solve(problem, lambda);
  EXPECT_NEAR(lambda[0], 1, 1e-12);
  EXPECT_NEAR(lambda[1], -0.5, 1e-12);
  EXPECT_NEAR(cone_error(problem, lambda).natural_map, 0, 1e-12);
  // With r = 0 û = (−2 + 1.5, 3, 0): its negative is projected to 1.6·(1, −0.5, 0), on the cone.
  const double normal = (0.5 + 0.5 * 3) / 1.25;
  const double wrong = std::hypot(normal, 0.5 * normal);
  EXPECT_NEAR(cone_error(problem, {0, 0, 0}).natural_map, wrong / std::sqrt(13.0), 1e-12);
}

TEST(FrozenProblem, JudgesAsymmetricAndIndefiniteMatrices) {
  int solved = 0;
  for (const char* const matrix : {"2 0.5 0\n-0.5 1 0.2\n0 -0.2 1", "2 0 0\n0 1 3\n0 3 1",
                                   "-1 0 0\n0 1 0\n0 0 1", "0 0 0\n0 0 0\n0 0 0", "1 2 2\n2 1 2\n2 2 1"}) {
    for (const char* const q : {"-2 3 0", "-2 0.1 0.1", "1 1 1", "-1 -5 5"}) {
      const FrozenProblem problem = parse_frozen_problem(one_contact(q, matrix), "one");
      std::vector<double> lambda;
      solve(problem, lambda);
      ASSERT_EQ(lambda.size(), 3u);
      const double error = cone_error(problem, lambda).natural_map;
      EXPECT_TRUE(std::isfinite(error)) << matrix << ' ' << q;
      solved += error < 1e-8 ? 1 : 0;
    }
  }
  EXPECT_GE(solved, 10);
}

TEST(FrozenProblem, SweepsConverge) {
  const FrozenProblem problem = parse_frozen_problem(dumped(7, 0.3), "dumped");
  std::vector<double> lambda;
  sweep_rows(problem, lambda, 10);
  const double early = cone_error(problem, lambda).natural_map;
  sweep_rows(problem, lambda, 990);
  EXPECT_LT(cone_error(problem, lambda).natural_map, 1e-3 * early);
}

TEST(FrozenProblem, NamesLineOfError) {
  const std::string good = to_siconos_text(parse_frozen_problem(dumped(2, 0.3), "dumped"));
  struct Trouble {
    std::string text;
    const char* complaint;
  };
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = one_contact("-2 3 0");
    return text.replace(text.find(from), from.size(), to);
  };
  const std::vector<Trouble> troubles{
      {"", "one:1: the file ends before the dimension"},
      {"2\n", "one:1: the dimension is 2"},
      {"3\n0\n", "one:2: the number of contacts is 0"},
      {"3\n1000000000\n", "one:2: the number of contacts"},
      {"3\n1\n7\n", "one:3: the storage of the matrix"},
      {replaced("3 3\n", "3 4\n"), "one:6: the number of columns, again is 4"},
      {replaced("2 0 0", "2 x 0"), "one:7: 'x' is no number"},
      {replaced("2 0 0", "2 nan 0"), "one:7: a value of the matrix is not finite"},
      {replaced("-2 3 0", "-2 inf 0"), "one:10: a value of q is not finite"},
      {replaced("0.5\n", "-0.5\n"), "below 0"},
      {one_contact("-2 3 0") + "1 1\n", "more follows"},
      {good.substr(0, good.size() / 2), "the file ends before"},
      {"substep mlcp 2\n", "one:1: another format"},
  };
  for (const Trouble& trouble : troubles) {
    const std::string message = test::message_of([&] { parse_frozen_problem(trouble.text, "one"); });
    EXPECT_NE(message.find(trouble.complaint), std::string::npos) << message;
  }
}

TEST(FrozenProblem, RefusesCorruptedTexts) {
  const std::string good = to_siconos_text(parse_frozen_problem(dumped(2, 0.3), "dumped"));
  int refused = 0;
  for (std::size_t i = 0; i < good.size(); i += 3) {
    for (const char wrong : {'x', '-', '9', ' '}) {
      std::string text = good;
      text[i] = wrong;
      try {
        const FrozenProblem problem = parse_frozen_problem(text, "wrong");
        EXPECT_LE(problem.mlcp.rows.size(), 3000u);
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace substep
