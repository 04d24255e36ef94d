#pragma once
/// Sweeps: the sweep file (scenes/sweeps.md) with scenes and the settings to measure, its jobs on one machine
/// or many, and their records. Each job has a file, so that finished jobs are neither lost nor run again.
///
/// A folder of results holds jobs/<key>.json, written by rename, and after the merge sweep.json (all
/// records, in the sweep file's order), errors.csv (the same in every run) and times.csv (which differs).
/// A job's file names the program, scene and settings that made it; one of another build is made again.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/measure/reference_cache.h"
#include "sim/measure/stepper.h"
#include "sim/measure/validity_maps.h"
#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

struct SweepJob {
  std::string key;  ///< name of its file: scene and settings, "rod_chain.a3-h1-n4-m1-t1-k1-plain"
  std::string scene;
  std::string engine;     ///< name of the engine; empty: one of our algorithms
  Settings settings;      ///< step included
  int divisions = 1;      ///< of the scene's step: the step is that / divisions
  bool is_limit = false;  ///< searches for the stability limit instead of measuring one run
};

struct Sweep {
  double horizon = 2;         ///< s that are compared with the reference
  int repetitions = 0;        ///< timed runs of each job
  int most = 64;              ///< sub-steps, iterations or parts of a step up to which limits are searched
  bool properties = false;    ///< true where figures measure further scenes than the sweep file's
  bool splits_errors = true;  ///< true where errors are split, and the stages of steps timed
  std::map<std::string, double> horizons;  ///< s, by name of scene, in place of `horizon`
  std::map<std::string, Scene> scenes;     ///< by name
  std::vector<SweepJob> jobs;              ///< in the file's order, each once

  double horizon_of(const std::string& scene) const;
};

/// Reads the file and its scenes. Throws Error with file and line where its content is invalid.
Sweep read_sweep(const std::filesystem::path& file);

/// Makes a sweep of these scenes without a file, at their default settings: A1 with h to h/8, A2 with an
/// eighth to four times its iterations, A3 to A5 with as many times their sub-steps. `maps`: A3 and A5 with
/// up to their usual sub-steps at h to h/8, and with five τ times five κ. Throws Error.
Sweep sweep_of(const std::vector<std::filesystem::path>& scenes, bool maps);

/// The kind of contacts in a scene.
enum class ContactKind {
  none,      ///< nothing can touch
  standing,  ///< the reference leaves every body where it starts
  moving,    ///< bodies slide, roll, fall or are hit
};

/// The result of a job.
struct SweepRecord : SweepJob {
  std::string label;  ///< "A3  n=4 m=1 plain  h=1/60", "Bullet SI  h=1/60"
  ContactKind contacts = ContactKind::none;
  double size = 0;               ///< of the scene, m
  double duration = 0;           ///< of the scene, s
  std::string reference;         ///< method by which the reference was made
  double uncertainty = 0;        ///< of the reference's positions, m
  double turn_uncertainty = 0;   ///< of the reference's turns, rad
  double horizon = 0;            ///< s
  std::string divergence_point;  ///< where the reference's refinements diverge at the horizon; empty: nowhere
  std::string omitted;           ///< reason why the job was not run; empty: it was run
  bool turns_in_place = false;   ///< the error of some run of the scene is turns alone; not in the file
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

/// Removes the files of the last merge, runs the jobs that are not done or were omitted, and returns their
/// number. `progress` receives the fraction of them that is done, on the calling thread. Throws Error for a
/// bad scene or an unwritable file; finished jobs stay.
int run_sweep(const Sweep& sweep, const SweepOptions& options, const std::function<void(double)>& progress);

/// Returns the damaged files of jobs, which are measured again. Throws Error where a job's path is no file.
std::vector<std::filesystem::path> damaged_jobs(const Sweep& sweep, const std::filesystem::path& results);

/// Writes sweep.json, errors.csv and times.csv, and returns the records. Throws Error when jobs are missing.
std::vector<SweepRecord> merge_sweep(const Sweep& sweep, const std::filesystem::path& results);

/// Reads the records of a merged sweep. Throws Error.
std::vector<SweepRecord> read_records(const std::filesystem::path& results);

std::string to_json(const SweepRecord& record);
/// Reads a record. Throws Error for other text.
SweepRecord record_in(const std::string& json);

/// Return CSV, a line for each record with figures, in SI units; the stages' times, s1 to s4, in µs a step.
std::string errors_csv(const std::vector<SweepRecord>& records);
std::string times_csv(const std::vector<SweepRecord>& records);

}  // namespace substep
