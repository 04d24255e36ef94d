#pragma once
/// The sweep file, with scenes and the settings to measure (scenes/sweeps.md).

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
/// eighth to four times its iterations, A3 to A5 with as many times their sub-steps. `maps`: A3 and A5 with
/// up to their usual sub-steps at h to h/8, and with five τ times five κ. Throws Error.
Sweep sweep_of(const std::vector<std::filesystem::path>& scenes, bool maps);

}  // namespace substep
