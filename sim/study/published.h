#pragma once
/// Results that others published, compared with ours. The file lists reported results and our runs:
///
///     [[result]]
///     name = "P1 Kapla tower"
///     scenes = ["published/kapla.gltf"]        # relative to the file; met if expectations hold
///     rule = "A1 and A5 stand at the default"  # in words, for the page
///     reported = [["RaiSim", "10 iterations", "25 steps"]]
///
///     [[result.run]]
///     name = "default"
///     algorithms = ["a1", "a5"]       # default: a1, a2, a3, a5
///     judged = ["a1", "a5"]           # those that have to meet the result; default: none
///     settings = { substeps = 10 }    # fields of settings_fields.h
///     steps = 2                       # steps of the scene per step of the run
///     duration = 6                    # s, where it is shorter than the scene's
///     against = "n = 4"               # figures are ratios: of the earlier run of this name to this run
///     at_least = 4                    # with `against`: the least ratio
///     time = true                     # also the mean CPU time of a step
///     forget_patches = true           # each step forms its contact patches anew
///     quick = true                    # belongs to the quick subset

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/measure/expectations.h"
#include "sim/measure/text_table.h"
#include "sim/model/settings.h"

namespace substep {

struct PublishedRun {
  std::string name;
  std::vector<Algorithm> algorithms;
  std::vector<Algorithm> judged;
  std::function<void(Settings&)> adjust;  ///< applies the file's `settings`
  int steps = 1;                          ///< steps of the scene per step of the run
  std::optional<double> duration;         ///< s
  std::string against;
  double at_least = 0;
  bool time = false;
  bool forget_patches = false;
  bool quick = false;
};

struct PublishedResult {
  std::string name;
  std::string rule;
  std::vector<std::filesystem::path> scenes;
  std::vector<std::vector<std::string>> reported;  ///< engine, setting, result
  std::vector<PublishedRun> runs;
};

/// Reads the file. Throws Error with file and line for what is unknown, missing, of a wrong type or out of
/// range.
std::vector<PublishedResult> read_published(const std::filesystem::path& file);

/// The figures of one expectation in one run, by algorithm.
struct PublishedFigure {
  std::string what;
  std::string run;
  std::map<Algorithm, ExpectedFigure> measured;
  bool is_time = false;
  std::vector<Algorithm> missed_by;  ///< of the judged algorithms
};

struct PublishedMeasurement {
  PublishedResult result;
  std::vector<PublishedFigure> figures;  ///< in the file's order
  bool is_met() const;
};

struct PublishedOptions {
  bool quick = false;
  std::string only;  ///< part of a result's name; empty: all
  int threads = 2;
  std::function<void(double)> progress;  ///< receives the fraction that is done
};

/// Runs the scenes of the results, and leaves out results that have no run by `options`. Throws Error where a
/// scene cannot be used or a run measures nothing.
std::vector<PublishedMeasurement> measure_published(const std::vector<PublishedResult>& results,
                                                    const PublishedOptions& options);

/// Returns each result's verdict and tables, results that are not met first.
std::string to_markdown(const std::vector<PublishedMeasurement>& measurements);

}  // namespace substep
