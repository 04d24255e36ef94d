#pragma once
/// Recommends settings for a scene from the measurements of a sweep.

#include <optional>
#include <string>
#include <vector>

#include "sim/study/sweep.h"

namespace substep {

/// Returns true for a measured run of one of the five algorithms.
bool is_own_run(const SweepRecord& record);

/// Returns "A3 with n = 16, plain joints, h = 1/60 s": n, m and the step, and what is not the default.
/// `joints`: whether the scene has joints.
std::string spoken(const SweepRecord& record, bool joints);

/// Returns the cost that choices minimise: CPU time where it was measured, otherwise rows solved.
double time_or_rows(const SweepRecord& record);

/// Returns the cheapest run of the five that is good enough; nothing if none is. A good run stays bounded
/// with an RMS error of at most `tolerance` (of the scene's size), its joints and contacts stay closed to
/// `tolerance`, its change of energy is within ten times `tolerance` of the most accurate run's, and no
/// finer run of the same algorithm and settings is unbounded.
/// `records`: of one scene.
std::optional<SweepRecord> cheapest(const std::vector<SweepRecord>& records, double tolerance);

/// The runs that no other one beats in both error and cost, the cheapest first.
std::vector<SweepRecord> best_runs(const std::vector<SweepRecord>& records);

/// CPU time of a simulated second, s; not a number where there are no times.
double cost_of(const SweepRecord& record);

/// Returns one paragraph on a scene: the cheapest settings for 1 % and 0.1 %, and settings that go wrong
/// later.
std::string advice(const std::vector<SweepRecord>& records);

/// By how many powers of two the error falls when h/n is halved: the least-squares slope of a family's finest
/// four runs whose error is above the reference's uncertainty. Nothing with fewer than three.
std::optional<double> measured_order(const std::vector<SweepRecord>& family);

/// The same from each run to the next with half its h/n: the middle of the two (geometric, s) and the slope.
/// Lost runs and errors that the reference is not sure of have none.
std::vector<std::pair<double, double>> local_orders(const std::vector<SweepRecord>& family);

}  // namespace substep
