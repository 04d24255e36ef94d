#pragma once
/// The sweep file: which scenes are measured with which settings.
///
///     horizon = 2                       # s: runs are compared with the reference until then, at most
///     repetitions = 5                   # of a run whose CPU time is measured; 0: no times
///     most = 64                         # how fine a search for the stability limit may go
///     properties = true                 # `substep report` also shows what the algorithms do on test scenes
///                                       # of their own, read from the sweep file's folder
///
///     parts = false                     # not the parts of errors, residuals and stages of steps
///
///     [horizons]                        # other horizons, by scene
///     rod_chain = 1
///
///     [[grid]]                          # all combinations of its lists. An absent list is the default of
///                                       # `substep run` for the scene and the algorithm
///     scenes = ["pendulum.gltf"]        # relative to the sweep file; a name with "*" is a shell's pattern
///     algorithms = ["a3", "a4", "a5"]
///     divisions = [1, 2, 4]             # of the scene's step: h = step / 1, step / 2, …
///     substeps = [1, 2, 4, 8]           # n; A1 and A2 have none
///     iterations = [1]                  # m; A1 has none
///     joints = ["plain", "stable"]      # and so any other field of settings_fields.h: tau, kappa, …
///     engines = ["bullet-si"]           # engines to run beside them, where the program was built with them
///
///     [[limit]]                         # how coarse each may be and stay bounded, by bisection. The same
///     scenes = ["pendulum.gltf"]        # keys but `divisions`, `substeps` and `engines`
///     algorithms = ["a3", "a4", "a5"]
///
/// Settings that an algorithm does not read make no jobs of their own: each run is made once.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

struct SweepJob {
  std::string key;  ///< "rod_chain.a3-h1-n4-m1-t1-k1-plain": a file's name, and what it does
  std::string scene;
  std::string engine;  ///< name of the engine; empty: one of our algorithms
  Settings settings;   ///< step included
  int divisions = 1;
  bool is_limit = false;  ///< looks for the stability limit instead of measuring one run
};

struct Sweep {
  std::filesystem::path file;
  double horizon = 2;
  int repetitions = 0;
  int most = 64;
  bool properties = false;
  bool parts = true;  ///< whether errors are taken apart and steps' stages are timed
  std::map<std::string, double> horizons;
  std::map<std::string, Scene> scenes;  ///< by name
  std::vector<SweepJob> jobs;           ///< in the file's order, each once

  double horizon_of(const std::string& scene) const;
};

/// Reads the file and its scenes. Throws Error with file and line for what is unknown, missing, of a wrong
/// type or out of range.
Sweep read_sweep(const std::filesystem::path& file);

/// Makes a sweep of these scenes without a file, at their default settings: A1 with h to h/8, A2 with an
/// eighth to four times its iterations, A3 to A5 with as many times their sub-steps. Throws Error.
Sweep sweep_of(const std::vector<std::filesystem::path>& scenes);

}  // namespace substep
