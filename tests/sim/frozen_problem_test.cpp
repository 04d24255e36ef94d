// Friction problems in files: Siconos' text of our own dumped problems, A1's solver without bodies, and what
// is refused.

#include "sim/direct/frozen_problem.h"

#include <gtest/gtest.h>

#include "sim/error.h"
#include "sim/model/usual_settings.h"
#include "tests/error_message.h"
#include "tests/sim/test_scenes.h"

namespace substep {
namespace {

/// The problem of a step in which a pile of boxes slides: `boxes` in a row two deep, pushed at 1 m/s.
std::string dumped(int boxes, double friction) {
  Scene scene = test::floor_scene(friction);
  for (int i = 0; i < boxes; ++i) {
    const int box = test::add_box(scene, {1, 1, 1}, 1 + i % 3,
                                  {{0.7 * (i / 2), 0.5 + i % 2, 0.1 * i}, Quaternion::Identity()}, friction);
    scene.bodies[box].linear_velocity = {1, 0, 0.3 * (i % 2)};
  }
  Settings settings = default_settings(Algorithm::a1);
  Simulation simulation(scene, settings);
  simulation.step();
  return simulation.last_problem();
}

TEST(FrozenProblem, MatrixGivesTheBodiesSolution) {
  for (const double friction : {0.0, 0.3, 0.9}) {
    for (const int boxes : {1, 2, 7, 24}) {
      const FrozenProblem bodies = parse_frozen_problem(dumped(boxes, friction), "dumped");
      const FrozenProblem matrix = parse_frozen_problem(to_siconos_text(bodies), "siconos");
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

TEST(FrozenProblem, SiconosTextRoundTrips) {
  const std::string text = to_siconos_text(parse_frozen_problem(dumped(5, 0.4), "dumped"));
  EXPECT_EQ(to_siconos_text(parse_frozen_problem(text, "siconos")), text);
}

/// One contact: W = diag(2, 1, 1), q, μ = 0.5.
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
  // With r = 0 û = (−2 + 1.5, 3, 0): its negative is projected to 0.4·(1, −0.5, 0)·… of the cone.
  const double normal = (0.5 + 0.5 * 3) / 1.25;
  const double wrong = std::hypot(normal, 0.5 * normal);
  EXPECT_NEAR(cone_error(problem, {0, 0, 0}).natural_map, wrong / std::sqrt(13.0), 1e-12);
}

TEST(FrozenProblem, JudgesWhatIsNotSymmetricOrIndefinite) {
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

TEST(FrozenProblem, NamesTheLineOfTrouble) {
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
        std::vector<double> lambda;
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
