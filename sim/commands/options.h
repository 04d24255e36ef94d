#pragma once
/// Options that several commands take, and their values as typed.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sim/loading/load_scene.h"
#include "sim/log/file_output.h"
#include "sim/model/settings.h"
#include "sim/scene/scene.h"

namespace substep {

/// "0.01" or "1/60", in seconds. `option` is for the message. Throws Error.
double seconds_in(const std::string& text, const std::string& option);

struct ImageSize {
  int width = 1280;
  int height = 720;
};

/// "1280x720". Throws Error.
ImageSize image_size_in(const std::string& text);

/// How to solve, as typed.
struct SolverOptions {
  std::string algorithm = std::string(name(Settings{}.algorithm));
  std::optional<std::string> step;
  std::optional<std::string> duration;
  std::optional<int> iterations;
  Settings numbers = default_settings(Settings{}.algorithm);  ///< the options that are plain numbers
  std::string joints = std::string(name(numbers.joints));

  /// Adds --step, --substeps, --iterations, --tau, --kappa, --joints and --duration.
  void add_to(CLI::App& command);
  /// Adds --algorithm, --relaxation and --tolerance.
  void add_algorithm_to(CLI::App& command);

  /// Throws Error naming what cannot be used.
  Settings settings(const Scene& scene) const;
  double seconds(const Scene& scene) const;
  /// How many steps the duration is. Throws Error above ten million.
  int steps(const Scene& scene, const Settings& settings) const;
};

/// Says on stderr, before work begins, where A1 will take minutes and gigabytes: its one problem of all
/// contacts grows with the square of what touches.
void note_cost_of_a1(const Scene& scene);

/// A scene's file and, for a mesh without a scene, how it becomes one; as typed.
struct SceneOptions {
  std::filesystem::path file;

  /// Adds the file as the command's argument, and the options below.
  void add_to(CLI::App& command);
  /// Adds --scale, --mass, --density, --height, --rotate and --copies.
  void add_mesh_options_to(CLI::App& command);

  /// Reads the scene and prints its warnings to stderr. Throws Error.
  Scene load() const { return load(file); }
  /// The same of another file.
  Scene load(const std::filesystem::path& other) const;
  /// Throws Error when an output is a file that the scene is read from, or another output.
  void require_separate(const std::vector<GivenFile>& outputs) const;
  /// What was given of the options for meshes; nothing when none was.
  std::optional<MeshOptions> mesh_options() const;

 private:
  std::optional<double> scale_, density_, mass_, height_;
  std::optional<int> copies_;
  std::vector<double> rotation_;
};

}  // namespace substep
