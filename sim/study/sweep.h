#pragma once
/// Runs the jobs of a sweep, on one machine or many. Each job has a file, so that finished jobs are neither
/// lost nor run again.
///
/// A folder of results holds jobs/<key>.json, written beside and renamed, and after the merge sweep.json (all
/// records, in the sweep file's order), errors.csv (the same in every run) and times.csv (which differs).
/// A job's file says which program, scene and settings made it; one of another build is made again.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/measure/reference_cache.h"
#include "sim/measure/stepper.h"
#include "sim/measure/validity_maps.h"
#include "sim/study/sweep_file.h"

namespace substep {

/// The kind of contacts in a scene.
enum class ContactKind {
  none,      ///< nothing can touch
  standing,  ///< the reference leaves every body where it starts
  moving,    ///< bodies slide, roll, fall or are hit
};

/// The result of a job.
struct SweepRecord {
  std::string key;
  std::string scene;
  std::string engine;  ///< empty: one of our algorithms
  std::string label;   ///< "A3  n=4 m=1 plain  h=1/60", "Bullet SI  h=1/60"
  Settings settings;
  int divisions = 1;  ///< of the scene's step: the step is that / divisions
  ContactKind contacts = ContactKind::none;
  double size = 0;               ///< of the scene, m
  double duration = 0;           ///< of the scene, s
  std::string reference;         ///< how it was made
  double uncertainty = 0;        ///< of it, m
  double turn_uncertainty = 0;   ///< rad
  double horizon = 0;            ///< s
  std::string divergence_point;  ///< where the reference's refinements part at the horizon; empty: nowhere
  std::string omitted;           ///< why this was not run; empty: it was
  /// Spectral radius of the map of a sub-step with these settings, where it has one (substep_map.h).
  std::optional<double> substep_radius;
  std::optional<Metrics> metrics;
  std::optional<RunTimes> times;
  std::optional<StabilityLimit> limit;
};

struct SweepOptions {
  std::filesystem::path results = "out/report";
  int threads = 0;  ///< 0: as many as the machine has
  int part = 1;     ///< of `parts`: the jobs part, part + parts, … of the list
  int parts = 1;
  ReferenceCache cache{};
};

/// Returns the kind of contacts of a scene, from its reference.
ContactKind contact_kind(const Scene& scene, const ReferenceMotion& reference);

/// Runs the jobs that are not done. `progress` receives the fraction of this call's work that is done, on the
/// calling thread. Returns the number of jobs that it ran. Throws Error where a scene cannot be modelled or a
/// file cannot be written; finished jobs stay.
int run_sweep(const Sweep& sweep, const SweepOptions& options, const std::function<void(double)>& progress);

/// Returns the jobs whose files are missing, of another build, or damaged.
std::vector<std::string> missing_jobs(const Sweep& sweep, const std::filesystem::path& results);

/// Returns the damaged files of jobs, which are measured again. Throws Error where a job's path is no file.
std::vector<std::filesystem::path> damaged_jobs(const Sweep& sweep, const std::filesystem::path& results);

/// Writes sweep.json, errors.csv and times.csv. Throws Error when jobs are missing.
void merge_sweep(const Sweep& sweep, const std::filesystem::path& results);

/// Reads the records of a merged sweep. Throws Error.
std::vector<SweepRecord> read_records(const std::filesystem::path& results);

}  // namespace substep
