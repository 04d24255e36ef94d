#pragma once
/// Internal to the claims: scenes, their disturbed variants and references, rows at one state, and one
/// function for each claim. claims.h has the report.

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "sim/constraints/contact_finder.h"
#include "sim/constraints/formulate.h"
#include "sim/measure/claims.h"
#include "sim/measure/measured_run.h"
#include "sim/simulation.h"

namespace substep::claims {

inline constexpr double horizon = 1;  // s: chaotic scenes are compared before they diverge

Settings settings_of(const Scene& scene, Algorithm algorithm, int n, int m, Joints joints = Joints::plain);

/// Runs a scene as the report does: A1 and A2 do not divide steps, even with taut joints.
MeasuredRun undivided_run(const Scene& scene, const Settings& settings, double duration);

/// Numbers in [−1, 1], the same in every run.
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

  std::vector<Contact> no_contacts;
  Model model;
  ContactFinder finder;
  State state;
  Problem problem;
};

/// Loads the scenes of the claims, runs them, and keeps their references.
class Measurement {
 public:
  explicit Measurement(const std::filesystem::path& folder);

  const Scene& scene(const std::string& name) const { return scenes_.at(name); }
  const std::filesystem::path& folder() const { return folder_; }

  /// Returns the reference of a scene. It is computed once, since A1 at small steps takes most of the time.
  const Reference& reference(const std::string& name);

  MeasuredRun run(const std::string& name, Algorithm algorithm, int n, int m, Joints joints) const;

  double error(const std::string& name, Algorithm algorithm, int n, int m, Joints joints);

 private:
  std::filesystem::path folder_;
  std::map<std::string, Scene> scenes_;
  std::map<std::string, Reference> references_;
};

/// Returns number, section, sentence and settings of a claim, without figures and cases. 1 to 14 are the
/// report's, 15 to 17 are ours.
Claim unmeasured_claim(int number);

/// Returns the time of the solver alone (s3, s4) in each step, s, of several procedures that step in turn.
/// Times differ from run to run.
std::vector<std::vector<double>> solver_times(const Scene& scene, const std::vector<Settings>& all,
                                              const std::vector<Procedure>& procedures, int steps);

double median(std::vector<double> values);

// claims_exactness.cpp
Claim claim1(Measurement& measurement);
Claim claim2(Measurement& measurement);
Claim claim4(Measurement& measurement);
Claim claim5(Measurement& measurement);
Claim claim8(Measurement& measurement);
Claim claim9(Measurement& measurement);  ///< has no scene
Claim claim10(Measurement& measurement);
Claim claim16(Measurement& measurement);

// claims_accuracy.cpp
Claim claim3(Measurement& measurement);
Claim claim6(Measurement& measurement);
Claim claim13(Measurement& measurement);
Claim claim14(Measurement& measurement);
Claim claim7(Measurement& measurement);
AblationCosts ablation(const Measurement& measurement, const std::string& name, int n);

// claims_stability.cpp
Claim claim11(Measurement& measurement);
Claim claim12(Measurement& measurement);
Claim claim15(Measurement& measurement);
Claim claim17(Measurement& measurement);
EnergyDrift energy_drift(const Measurement& measurement, const std::string& run, Algorithm algorithm,
                         Joints joints, const std::vector<std::string>& names);

}  // namespace substep::claims
