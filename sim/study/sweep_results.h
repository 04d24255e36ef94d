#pragma once
/// Queries on the records of a sweep, and recommendations from them.

#include <optional>
#include <string>
#include <vector>

#include "sim/study/sweep.h"

namespace substep {

/// Returns the records of one scene, in the sweep's order.
std::vector<SweepRecord> of_scene(const std::vector<SweepRecord>& records, const std::string& scene);
/// Returns the names of the scenes, in the sweep's order.
std::vector<std::string> scenes_of(const std::vector<SweepRecord>& records);

/// Returns true for a run of another engine.
bool is_other_engine(const SweepRecord& record);

/// Returns the RMS error over the scene's size; for bodies that turn about their centres the RMS turn in rad.
/// It is not finite where the run ended early.
double error_of(const SweepRecord& record);
/// Returns error_of(); where the reference is known at the start alone, the largest joint gap or overlap over
/// the scene's size.
double error_or_gap_of(const SweepRecord& record);
/// Returns the title of error_or_gap_of() for these records of one scene: "RMS error / size" or another.
std::string error_or_gap_title(const std::vector<SweepRecord>& records);
/// Returns true where the error is at least a hundred times the reference's uncertainty, or is rounding
/// (below `smallest_plotted_error`).
bool exceeds_uncertainty(const SweepRecord& record);

/// Runs that differ in one setting alone: the step of A1 or an engine, A2's step or m, the sub-steps of A3 to
/// A5 and Soft Step, AVBD's iterations.
struct RunFamily {
  std::string title;  ///< "A3 plain", "A2 m=16"
  std::vector<SweepRecord> runs;
};

/// Returns the families of one scene's records, A1 first. Families of A3 to A5 are of the runs with the
/// fewest measured iterations: those at the scene's step or, where n never changes, those at all steps.
std::vector<RunFamily> families_of(const std::vector<SweepRecord>& records);

/// Measured runs that are in no family for the same reason.
struct RunsLeftOut {
  std::string title;
  std::string reason;
  int count = 0;
};
/// Returns the measured runs of one scene that are in no family.
std::vector<RunsLeftOut> left_out_of(const std::vector<SweepRecord>& records);

/// Returns true where some run had overlapping bodies.
bool has_contacts(const std::vector<SweepRecord>& records);
/// Returns true where joints opened in some run.
bool has_joints(const std::vector<SweepRecord>& records);

/// A run that solves as many rows as n sub-steps of single rows with one iteration each.
struct EqualRowRun {
  int n = 1;
  SweepRecord record;
};
/// Returns the runs at the scene's step and τ = κ = 1 of A3 with joints=rows and m = 1, and those of A2, with
/// any m, without other settings. Of A2 n is m times the equal parts in which it takes the scene's step.
std::vector<EqualRowRun> equal_row_runs(const std::vector<SweepRecord>& records, const std::string& scene);

/// Returns error_or_gap_of() as percent() does, or "0.13 rad".
std::string error_text(const SweepRecord& record);
/// Returns true where bodies turn about their centres, so that errors are turns.
bool turns_in_place(const std::vector<SweepRecord>& records);
/// Sets `turns_in_place` in all records of scenes where it is true for a run of ours.
void mark_turns(std::vector<SweepRecord>& records);

/// Returns "1.2 %"; "lost" where the number is not finite, "rounding" below 1e-11.
std::string percent(double fraction);

/// Smallest error in plots: smaller ones are drawn here.
inline constexpr double smallest_plotted_error = 1e-10;

/// Returns true for a measured run of one of our algorithms: the five, Soft Step or AVBD.
bool is_own_run(const SweepRecord& record);

/// Returns "A3 with n = 16, plain joints, h = 1/60 s": n, m, the step and the other settings where they are
/// not the defaults. `joints`: whether the scene has joints.
std::string spoken(const SweepRecord& record, bool joints);

/// Returns the cost that choices minimise: CPU time where it was measured, otherwise rows solved.
double time_or_rows(const SweepRecord& record);

/// Returns the cheapest of our runs that is good enough; nothing if none is. A good run stays bounded
/// with an RMS error of at most `tolerance` (of the scene's size), its joints and contacts stay closed to
/// `tolerance`, its change of energy is within ten times `tolerance` of the most accurate run's or, without
/// contacts, of 0, and no finer run of the same algorithm and settings is unbounded. `records`: of one scene.
std::optional<SweepRecord> cheapest(const std::vector<SweepRecord>& records, double tolerance);

/// Returns the bounded runs that err by a fifth less than every cheaper one, the cheapest first.
std::vector<SweepRecord> best_runs(const std::vector<SweepRecord>& records);

/// Returns the sub-step of a run, s: of an engine whose iterations are sub-steps, the step over these.
double substep_of(const SweepRecord& record);

/// Returns the CPU time of a simulated second, s; NaN where there are no times.
double cpu_time_of(const SweepRecord& record);

/// Returns one paragraph on a scene: the cheapest settings for 1 % and 0.1 %, and settings that look good
/// as long as the reference lasts, and are not.
std::string advice(const std::vector<SweepRecord>& records);

/// Returns the order of the error in h/n: the least-squares slope of a family's finest four bounded runs with
/// errors above rounding and exceeds_uncertainty(). Nothing with fewer than three, or where h/n is the same.
std::optional<double> measured_order(const std::vector<SweepRecord>& family);

}  // namespace substep
