#pragma once
/// Internal to the claims: scenes, their disturbed variants and references, rows at one state, and one
/// function for each claim. claims.h has the report.

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/measure/claims.h"
#include "sim/measure/measured_run.h"
#include "sim/simulation.h"

namespace substep::claims {

inline constexpr double horizon = 1;  // s: chaotic scenes are compared before they diverge

Settings settings_of(const Scene& scene, Algorithm algorithm, int n, int m, Joints joints = Joints::plain);

/// Returns numbers in [−1, 1], the same in every run.
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint32_t seed) : engine_(seed) {}
  double next() { return static_cast<double>(engine_() >> 8) / 8388608.0 - 1; }
  Vector3 next_vector() {
    const double x = next();
    const double y = next();
    return {x, y, next()};
  }

 private:
  std::linear_congruential_engine<std::uint32_t, 1664525, 1013904223, 0> engine_;
};

/// Turns every body and gives it velocities, both at random; joints are then violated.
Scene disturbed(Scene scene, std::uint32_t seed, double amount);

/// A scene's rows at one state, formulated as the algorithms do.
struct Formulated {
  Formulated(const Scene& scene, Joints joints, double hs);
  Formulated(const Formulated&) = delete;
  Formulated& operator=(const Formulated&) = delete;

  std::vector<Velocity> local_velocities() const;

  /// Returns a row of joints as (III) has it in the world's frame: ᵣJᵀ = R ᵣJ̆ᵀ, and M⁻¹Jᵀ with the moment of
  /// inertia of the turned body.
  Row in_world(const Block& x, int row) const;

  Model model;
  ContactFinder finder;
  State state;
  Problem problem;
};

/// Loads the scenes of the claims, runs them, and keeps their references.
class Measurement {
 public:
  explicit Measurement(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Returns a scene of the folder, or "tumbling rod_chain". Throws Error where it cannot be read.
  const Scene& scene(const std::string& name);
  const std::filesystem::path& folder() const { return folder_; }

  /// Returns the reference of a scene. It is computed once, since A1 at small steps takes most of the time.
  const State& reference(const std::string& name);

  /// Runs a scene to the horizon as the report does: A1 and A2 do not divide steps, even with taut joints.
  MeasuredRun run(const std::string& name, Algorithm algorithm, int n, int m, Joints joints);

  double error(const std::string& name, Algorithm algorithm, int n, int m, Joints joints);

 private:
  std::filesystem::path folder_;
  std::map<std::string, Scene> scenes_;
  std::map<std::string, State> references_;
};

/// Returns the largest distance of a body's centre between A3 with these settings and small-step
/// position-based dynamics without compliance, over `duration`, m. Throws Error where a body is not in the
/// plane z = 0. See small_step_xpbd.cpp.
double distance_from_xpbd(const Scene& scene, const Settings& settings, double duration);

/// Measures one claim.
using MeasureClaim = Claim(Measurement& measurement);
MeasureClaim claim1, claim2, claim4, claim5, claim8, claim9, claim10, claim16;  // claims_exactness.cpp
MeasureClaim claim3, claim6, claim7, claim13, claim14;                          // claims_accuracy.cpp
MeasureClaim claim11, claim12, claim15, claim17, claim18;                       // claims_stability.cpp

}  // namespace substep::claims
