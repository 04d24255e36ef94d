/// Scenes of the library against the closed forms and published values on their pages.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "sim/rotation.h"
#include "sim/scene/scene.h"
#include "sim/simulation.h"

namespace substep {
namespace {

constexpr std::array all{Algorithm::a1, Algorithm::a2, Algorithm::a3, Algorithm::a4, Algorithm::a5};

Scene library_scene(const std::string& name) {
  return load_scene(std::string(SUBSTEP_SOURCE_DIR) + "/scenes/" + name + ".gltf");
}

int body_named(const Scene& scene, const std::string& name) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  ADD_FAILURE() << name;
  return 0;
}

Settings settings_of(Algorithm algorithm, double step) {
  Settings settings;
  settings.algorithm = algorithm;
  settings.step = step;
  settings.substeps = 4;
  settings.iterations = algorithm == Algorithm::a2 ? 32 : 8;
  return settings;
}

/// Runs for `duration` and calls `look` with each step's time and state.
State run(const Scene& scene, const Settings& settings, double duration,
          const std::function<void(double, const State&)>& look = {}) {
  Simulation simulation(scene, settings);
  const auto steps = std::lround(duration / settings.step);
  for (long i = 1; i <= steps; ++i) {
    if (simulation.step().status == StepReport::Status::diverged) {
      ADD_FAILURE() << scene.name << " diverged, " << label(settings);
      break;
    }
    if (look) look(static_cast<double>(i) * settings.step, simulation.state());
  }
  return simulation.state();
}

/// Angle about +Y of a point, from +X towards −Z.
double azimuth(const Vector3& x) {
  return std::atan2(-x.z(), x.x());
}

TEST(Scenes, HeavyTopGoesRoundAsPublished) {
  const Scene scene = library_scene("heavy_top");
  const Vector3 pivot(0, 0.62, 0);
  for (const Algorithm algorithm : all) {
    const Settings settings = settings_of(algorithm, 1.0 / 960);
    double turned = 0;
    double tilt = 0;
    double energy_error = 0;
    double last = azimuth(scene.bodies[1].pose.position - pivot);
    run(scene, settings, 10, [&](double, const State& state) {
      const Vector3 arm = state.q[1].linear - pivot;
      const double now = azimuth(arm);
      turned += std::remainder(now - last, 2 * M_PI);
      last = now;
      tilt = std::max(tilt, std::acos(arm.y() / arm.norm()));
      const Vector3 local = state.q[1].angular.conjugate() * state.v[1].angular;
      const double energy =
          state.v[1].linear.squaredNorm() +
          0.5 * local.dot(scene.bodies[1].inverse_inertia.cwiseInverse().cwiseProduct(local)) + 20 * arm.y();
      energy_error = std::max(energy_error, std::fabs(energy - 1269.97500521));
    });
    std::printf("heavy_top %s: turned %.6f tilt %.7f energy error %.5g\n", name(algorithm).data(), turned,
                tilt, energy_error);
  }
}

TEST(Scenes, BallsRollWithThePartOfTheirSpeedThatTheirMomentLeaves) {
  const Scene scene = library_scene("sliding_ball");
  for (const Algorithm algorithm : all) {
    const State state = run(scene, settings_of(algorithm, 1.0 / 60), 1.2);
    std::printf("sliding %s:", name(algorithm).data());
    for (const auto& [ball, speed] : {std::pair{"solid_ball", 25.0 / 7}, {"hollow_ball", 3.0}}) {
      const int i = body_named(scene, ball);
      std::printf(" %.3g %.3g", state.v[i].linear.x() - speed, state.v[i].angular.z() * 0.2 + speed);
      const double t = (5 - speed) / (0.3 * 9.81);
      const double way = 5 * t - 0.5 * 0.3 * 9.81 * t * t + speed * (1.2 - t);
      std::printf(" way %.3g;", state.q[i].linear.x() + 2.2 - way);
    }
    std::printf("\n");
  }
}

TEST(Scenes, TrayAndBallsGoAsSimBenchmarkSays) {
  const Scene scene = library_scene("balls_on_tray");
  for (const Algorithm algorithm : all) {
    const State state = run(scene, settings_of(algorithm, 1.0 / 60), 2);
    double low = 1e9, high = -1e9;
    for (int i = 1; i <= 25; ++i) {
      const double v = state.v[body_named(scene, "ball_" + std::to_string(i))].linear.x();
      low = std::min(low, v);
      high = std::max(high, v);
    }
    std::printf("tray %s: %.5f balls %.5f %.5f\n", name(algorithm).data(),
                state.v[body_named(scene, "tray")].linear.x() / 2, low / 2, high / 2);
  }
}

TEST(Scenes, ShakenBlocksSlipAsFarAsTheClosedFormSays) {
  const Scene scene = library_scene("shaken_block");
  const int table = body_named(scene, "table");
  for (const Algorithm algorithm : all) {
    for (const double step : {1.0 / 960}) {
      std::printf("shaken %s:", name(algorithm).data());
      for (const char* block : {"rubber_block", "wooden_block", "waxed_block"}) {
        const int i = body_named(scene, block);
        double low = 0;
        double high = 0;
        run(scene, settings_of(algorithm, step), 4, [&](double, const State& state) {
          const double x = state.q[i].linear.x() - state.q[table].linear.x();
          low = std::min(low, x);
          high = std::max(high, x);
        });
        std::printf(" %.6f %.6f;", low, high);
      }
      std::printf("\n");
    }
  }
}

TEST(Scenes, CradleGivesBothAnswers) {
  const Scene scene = library_scene("cradle");
  for (const Algorithm algorithm : all) {
    std::array<double, 5> touching{};
    std::array<double, 5> spaced{};
    run(scene, settings_of(algorithm, 1.0 / 240), 0.62, [&](double t, const State& state) {
      for (int i = 0; i < 5; ++i) {
        const double a = state.v[body_named(scene, "touching_" + std::to_string(i + 1))].linear.x();
        const double b = state.v[body_named(scene, "spaced_" + std::to_string(i + 1))].linear.x();
        if (i == 0 ? a < touching[i] : a > touching[i]) touching[i] = a;
        if (t > 0.6) spaced[i] = b;
      }
    });
    std::printf("cradle %s: touching", name(algorithm).data());
    for (const double v : touching) std::printf(" %.4f", v / 1.5425358);
    std::printf(" spaced");
    for (const double v : spaced) std::printf(" %.4f", v / 1.5425358);
    std::printf("\n");
  }
}

TEST(Scenes, GatesSwingAlikeOnAnyNumberOfHinges) {
  const Scene scene = library_scene("door");
  for (const Algorithm algorithm : all) {
    Settings settings = settings_of(algorithm, 1.0 / 240);
    std::printf("door %s:", name(algorithm).data());
    for (const int count : {1, 2, 5, 10}) {
      const int i = body_named(scene, "hinges_" + std::to_string(count));
      // It swings to the other side and back: half a period between the two ends.
      const Vector3 axis(std::sin(0.25), std::cos(0.25), 0);
      double last = 0;
      std::vector<double> ends;
      run(scene, settings, 4, [&](double t, const State& state) {
        const double rate = state.v[i].angular.dot(axis);
        if (last * rate < 0) ends.push_back(t - settings.step * rate / (rate - last));
        last = rate;
      });
      std::printf(" %.5f", ends.size() > 1 ? ends[1] : 0.0);
    }
    std::printf("\n");
  }
}

TEST(Scenes, TurntableCarriesABallWithTwoSeventhsAndHoldsBlocksWithinItsFriction) {
  const Scene scene = library_scene("turntable");
  for (const Algorithm algorithm : all) {
    double low = 1, high = 0, turned = 0, last = 0;
    const int ball = body_named(scene, "ball");
    const State state = run(scene, settings_of(algorithm, 1.0 / 60), 6, [&](double, const State& now) {
      const Vector3 x = now.q[ball].linear;
      turned += std::remainder(azimuth(x) - last, 2 * M_PI);
      last = azimuth(x);
      const double r = std::hypot(x.x(), x.z());
      low = std::min(low, r);
      high = std::max(high, r);
    });
    std::printf("turntable %s: turned %.6f of %.6f r %.5f %.5f blocks", name(algorithm).data(), turned,
                30.0 / 7, low, high);
    for (const char* block : {"inner_block", "middle_block", "outer_block"}) {
      const Vector3 x = state.q[body_named(scene, block)].linear;
      std::printf(" %.5f", std::hypot(x.x(), x.z()));
    }
    std::printf("\n");
  }
}

TEST(Scenes, SqueezerEndsAsPublished) {
  const Scene scene = library_scene("squeezer");
  const std::array<double, 7> q{15.81077119629904, -15.75637105984298, .04082224013073101, -.5347301163226948,
                                .5244099658805304, .5347301163226948,  1.048080741042263};
  const std::array<std::pair<const char*, double>, 7> angles{{{"crank", q[0]},
                                                              {"rod", q[0] + q[1]},
                                                              {"lever", q[2]},
                                                              {"upper_link", q[3] + q[4]},
                                                              {"upper_arm", q[4]},
                                                              {"lower_link", q[5] + q[6]},
                                                              {"lower_arm", q[6]}}};
  for (const Algorithm algorithm : all) {
    for (const double step : {1.0 / 1000, 1.0 / 4000}) {
      Settings settings = settings_of(algorithm, step);
      const State state = run(scene, settings, 3);
      std::printf("squeezer %s %g:", name(algorithm).data(), step);
      for (const auto& [body, angle] : angles) {
        const Vector3 turn = rotation_vector(state.q[body_named(scene, body)].angular);
        std::printf(" %.4g", std::remainder(turn.z() - angle, 2 * M_PI));
      }
      std::printf("\n");
    }
  }
}

TEST(Scenes, PainlevesRodComesToTheParadoxAsPublished) {
  const Scene scene = library_scene("painleve_rod");
  for (const Algorithm algorithm : all) {
    for (const double step : {1.0 / 960, 1.0 / 7680, 1.0 / 61440}) {
      double time = 0, rate = 0, slip = 0;
      run(scene, settings_of(algorithm, step), 0.95, [&](double t, const State& state) {
        if (time > 0) return;
        const int rod = body_named(scene, "rod");
        const Vector3 along = state.q[rod].angular * Vector3::UnitX();
        if (-along.y() < std::sin(M_PI / 4)) return;
        time = t;
        rate = -state.v[rod].angular.z();
        slip = (state.v[rod].linear + state.v[rod].angular.cross(along)).x() + 30;
      });
      std::printf("painleve %s %g: %.4f %.3f %.3f\n", name(algorithm).data(), step, time, rate, slip);
    }
  }
}

TEST(Scenes, ABallWithRestitutionStopsAfterInfinitelyManyBounces) {
  const Scene scene = library_scene("bouncing_balls");
  const int ball = body_named(scene, "ball_2");
  for (const Algorithm algorithm : all) {
    for (const double step : {1.0 / 60, 1.0 / 960}) {
      double moving = 0;
      run(scene, settings_of(algorithm, step), 3, [&](double t, const State& state) {
        if (state.v[ball].linear.norm() > 1e-9) moving = t;
      });
      std::printf("zeno %s %g: %.5f\n", name(algorithm).data(), step, moving);
    }
  }
}

}  // namespace
}  // namespace substep
