#pragma once
// Checks that draw their scenes from a seed: each prints one row of a table, the worst error of each
// algorithm beside the limit.
//
// SUBSTEP_TRIALS=400 draws that many instead of 12; SUBSTEP_TRIAL=17 repeats one and prints each
// algorithm's error.

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <random>

#include "sim/loading/scene_settings.h"
#include "sim/model/usual_settings.h"
#include "tests/sim/test_scenes.h"

namespace substep::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Returns a number uniform in [least, most).
  double between(double least, double most) {
    return least + (most - least) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  /// Returns a number whose logarithm is uniform. `least` and `most` are positive.
  double spread(double least, double most) { return least * std::pow(most / least, between(0, 1)); }
  int below(int count) { return static_cast<int>(between(0, count)); }
  bool flip() { return below(2) == 1; }
  template <class Value>
  Value one_of(std::initializer_list<Value> values) {
    return *std::next(values.begin(), below(static_cast<int>(values.size())));
  }
  Vector3 direction() {
    const double y = between(-1, 1);
    const double turn = between(0, 2 * pi);
    const double across = std::sqrt(1 - y * y);
    return {across * std::cos(turn), y, across * std::sin(turn)};
  }
  /// Returns a unit vector perpendicular to a unit `axis`.
  Vector3 across(const Vector3& axis) {
    const Vector3 d = direction();
    return (d - axis.dot(d) * axis).normalized();
  }
  Quaternion orientation() { return rotation_quaternion(direction() * between(0, pi)); }

 private:
  std::mt19937_64 engine_;
};

/// One drawn scene with its closed form.
struct Trial {
  std::string parameters;                  ///< for the message of a failure
  std::function<double(Algorithm)> error;  ///< infinite where the run diverges
};

struct Check {
  const char* name;
  double limit;
  std::function<Trial(Random&)> draw;
  std::vector<Algorithm> algorithms{all_algorithms.begin(), all_algorithms.end()};
};

inline int number_from_environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

/// Returns the default settings of a run, as for a scene file that gives no n.
inline Settings default_settings_of(Scene scene, Algorithm algorithm) {
  scene.substeps = needed_substeps(scene);
  return usual_settings(scene, algorithm);
}

/// Return a trial whose error is the last, or the largest, `error(state, time)` after a step.
template <class Error>
Trial last_of(std::string parameters, const Scene& scene, double duration, const Error& error) {
  return {std::move(parameters), [=](Algorithm algorithm) {
            return last(scene, default_settings_of(scene, algorithm), duration, error);
          }};
}
template <class Error>
Trial largest_of(std::string parameters, const Scene& scene, double duration, const Error& error) {
  return {std::move(parameters), [=](Algorithm algorithm) {
            return largest(scene, default_settings_of(scene, algorithm), duration, error);
          }};
}

/// Draws the check's trials, prints "| name | A1 | … | A5 | limit |" and expects no algorithm's worst beyond
/// the limit.
inline void run(const Check& check) {
  const int only = number_from_environment("SUBSTEP_TRIAL", -1);
  const int count = number_from_environment("SUBSTEP_TRIALS", 12);
  std::array<double, 5> worst{};
  std::array<std::string, 5> where;
  for (int number = only < 0 ? 0 : only; number < (only < 0 ? count : only + 1); ++number) {
    Random random(static_cast<std::uint64_t>(number) + 1);
    const Trial trial = check.draw(random);
    for (const Algorithm algorithm : check.algorithms) {
      const auto i = static_cast<std::size_t>(algorithm);
      double error = trial.error(algorithm);
      if (std::isnan(error)) error = infinity;
      if (only >= 0) fmt::print("{} {}: {:.3g}\n", title_of(algorithm), trial.parameters, error);
      if (error < worst[i] || (error == worst[i] && !where[i].empty())) continue;
      worst[i] = error;
      where[i] = fmt::format("SUBSTEP_TRIAL={}: {}", number, trial.parameters);
    }
  }
  std::string row = fmt::format("| {} |", check.name);
  for (const Algorithm algorithm : all_algorithms) {
    const bool is_run = std::ranges::find(check.algorithms, algorithm) != check.algorithms.end();
    row += is_run ? fmt::format(" {:.2g} |", worst[static_cast<std::size_t>(algorithm)]) : " – |";
  }
  fmt::print("{} {:g} |\n", row, check.limit);
  for (const Algorithm algorithm : check.algorithms) {
    const auto i = static_cast<std::size_t>(algorithm);
    EXPECT_LE(worst[i], check.limit) << title_of(algorithm) << ", " << where[i];
  }
}

}  // namespace substep::test
