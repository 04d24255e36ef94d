#pragma once
/// Options that several commands share, and their typed values.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/measure/reference_cache.h"
#include "sim/model/settings.h"
#include "sim/model/settings_fields.h"
#include "sim/scene/scene.h"

namespace substep {

struct Sweep;
struct SweepRecord;

/// Reads seconds: "0.01" or "1/60". `option` is for the message. Throws Error.
double seconds_in(const std::string& text, const std::string& option);

/// Reads two whole numbers with a separator between them, such as "2/8". Returns nothing for other text.
std::optional<std::pair<int, int>> two_numbers_in(std::string_view text, char separator);

struct ImageSize {
  int width = 1280;
  int height = 720;
};

/// Reads a size: "1280x720". Throws Error.
ImageSize image_size_in(const std::string& text);

/// The typed settings of solving: --algorithm, --step and --substeps, and --set for all fields of Settings.
class SolverOptions {
 public:
  std::optional<std::string> duration;

  /// Adds --step, --substeps, --set and --duration.
  void add_to(CLI::App& command);
  /// Adds --algorithm, to commands that run one.
  void add_algorithm_to(CLI::App& command);

  /// Returns true where the field was typed. Throws Error where --set cannot be read.
  bool has(std::string_view field) const;
  /// Returns the algorithm's defaults and the scene's step with the typed settings, without checking ranges.
  /// Throws Error for a value that cannot be read, and for a field that is given twice.
  Settings settings(const Scene& scene, Algorithm algorithm) const;
  /// Returns the settings of the typed algorithm. Throws Error naming a value that cannot be used.
  Settings settings(const Scene& scene) const;
  double seconds(const Scene& scene) const;
  /// Returns the number of steps of the duration. Throws Error above ten million.
  int steps(const Scene& scene, const Settings& settings) const;

 private:
  TypedSettings in_set() const;
  bool is_in_set(std::string_view field) const;
  void apply_to(Settings& settings) const;

  std::optional<std::string> algorithm_, step_, substeps_;
  std::vector<std::string> set_;
};

/// --no-cache, of commands that compute references.
struct CacheOption {
  bool is_off = false;

  void add_to(CLI::App& command);
  /// Returns the user's cache, or one that keeps nothing.
  ReferenceCache cache() const { return is_off ? ReferenceCache() : ReferenceCache::of_user(); }
};

/// Says on stderr, before work begins, where A1 will solve the contacts of thousands of bodies as one
/// problem.
void note_cost_of_a1(const Scene& scene);

/// Says on stderr which of the sweep's results are damaged: they are measured again.
void note_damaged_jobs(const Sweep& sweep, const std::filesystem::path& results);

/// Says on stderr how many runs of a sweep are omitted, and why the first is.
void note_omitted_runs(const std::vector<SweepRecord>& records);

/// A scene's file and, for a mesh without a scene, how it becomes one; as typed.
struct SceneOptions {
  std::filesystem::path file;

  /// Adds the file as the command's argument, and the options below.
  void add_to(CLI::App& command);
  /// Adds --scale, --mass, --density, --height, --rotate and --copies.
  void add_mesh_options_to(CLI::App& command);

  /// Reads the scene and prints its warnings to stderr. Throws Error.
  Scene load() const { return load(file); }
  /// Reads another file likewise.
  Scene load(const std::filesystem::path& other) const;
  /// Throws Error when an output is a file that the scene is read from, or another output.
  void require_separate(const std::vector<GivenFile>& outputs) const;
  /// Returns the typed options for meshes; nothing where none was.
  std::optional<MeshOptions> mesh_options() const;

 private:
  MeshOptions mesh_;
  std::vector<double> rotation_;  ///< degrees about x, y and z; empty: not typed
  std::vector<CLI::Option*> options_of_mesh_;
};

}  // namespace substep
