#pragma once
/// The reference that errors are measured from: two runs of different steps.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/video/comparison.h"
#include "render/video/recorded_run.h"

namespace substep::render {

/// One of the two runs that are the reference.
struct ReferenceAttempt {
  std::vector<std::vector<Coordinates>> poses;
  std::optional<double> ended;     ///< when it could not go on, s
  std::optional<double> unsolved;  ///< when a step was not solved first, s
  int unsolved_steps = 0;
};

nlohmann::json to_json(const ReferenceAttempt& attempt);
ReferenceAttempt attempt_in(const nlohmann::json& json);

/// Returns whether two refinements agree so well that smaller steps would show nothing new.
bool is_settled(const Scene& scene, const std::vector<Coordinates>& one,
                const std::vector<Coordinates>& other);

/// Simulates one of the two, with steps of `step` / `divisions`. `is_smooth`: by the reference integrator;
/// else by A1, which stops where a frame is not `like` the other run's.
void simulate_reference(const Scene& scene, const FrameClock& clock, double step, int divisions,
                        bool is_smooth, ReferenceAttempt& attempt, Tally& tally,
                        const ReferenceAttempt* like = nullptr);

/// Returns whether the scene's forces are smooth.
bool has_smooth_reference(const Scene& scene, double step);

/// Returns what the two runs say together: until when the finer is a reference.
ReferenceRun reference_of(const Scene& scene, const ReferenceAttempt& coarse, ReferenceAttempt fine,
                          const std::vector<double>& times, const std::string& method);

/// Returns 0 where there are no values.
double root_mean_square(const std::vector<double>& values);

}  // namespace substep::render
