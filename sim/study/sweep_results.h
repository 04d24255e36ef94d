#pragma once
/// Queries on the records of a sweep.

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

/// Returns the RMS error over the scene's size; for bodies that turn in place the RMS turn in rad. It is not
/// finite where the run ended early.
double error_of(const SweepRecord& record);
/// Returns error_of(), or where the reference ends at the start the largest joint gap or overlap over the
/// scene's size.
double miss_of(const SweepRecord& record);
/// Returns the title of miss_of() for these records of one scene: "RMS error / size" or another.
std::string miss_title(const std::vector<SweepRecord>& records);
bool turns_in_place(const std::vector<SweepRecord>& records);
/// Returns true where the error is at least a hundred times the reference's uncertainty, or is rounding
/// (below `smallest_plotted_error`).
bool is_sure(const SweepRecord& record);

/// Runs that differ in one setting alone: the step of A1 and A2, the sub-steps of A3 to A5, the step of a
/// engine.
struct RunFamily {
  std::string title;  ///< "A3 plain", "A2 m=16"
  std::vector<SweepRecord> runs;
};

/// Returns the families of one scene's records, A1 first. Families of A3 to A5 have the fewest measured
/// iterations and the scene's step, or all steps where n is the same.
std::vector<RunFamily> families_of(const std::vector<SweepRecord>& records);

/// Returns the measured runs of one scene that are in no family.
struct RunsLeftOut {
  std::string title;
  std::string reason;
  int count = 0;
};
std::vector<RunsLeftOut> left_out_of(const std::vector<SweepRecord>& records);

/// Returns true where some run had overlapping bodies: the sweep ran the scene for its contacts.
bool has_contacts(const std::vector<SweepRecord>& records);

/// Returns true where joints opened in some run: the sweep ran the scene for its joints.
bool has_joints(const std::vector<SweepRecord>& records);

/// Returns the runs of A3 with single rows and of A2 with as many row solves, at the scene's step and τ = κ =
/// 1.
std::vector<SweepRecord> equal_row_runs(const std::vector<SweepRecord>& records, const std::string& scene);

/// Returns the largest step of the records, which is the scene's.
double scene_step(const std::vector<SweepRecord>& records);

/// Returns "1.2 %"; "lost" where the number is not finite, "rounding" below 1e-11.
std::string percent(double share);

/// Less is rounding: runs that do it exactly are drawn there.
inline constexpr double smallest_plotted_error = 1e-10;

}  // namespace substep
