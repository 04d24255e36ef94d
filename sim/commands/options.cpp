#include "sim/commands/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "sim/error.h"
#include "sim/loading/load_scene.h"
#include "sim/loading/scene_files.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

}  // namespace

double seconds_in(const std::string& text, const std::string& option) {
  const std::size_t slash = text.find('/');
  const auto above = number_in(std::string_view(text).substr(0, slash));
  const auto below = slash == std::string::npos ? 1.0 : number_in(std::string_view(text).substr(slash + 1));
  if (!above || !below || *below == 0) {
    throw Error(fmt::format("{} '{}': give seconds, such as 0.01 or 1/60", option, text));
  }
  return *above / *below;
}

ImageSize image_size_in(const std::string& text) {
  ImageSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  const bool times = width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x';
  const auto height = times ? std::from_chars(width.ptr + 1, end, size.height) : width;
  if (!times || height.ec != std::errc{} || height.ptr != end || size.width < 1 || size.height < 1 ||
      size.width > 8192 || size.height > 8192) {
    throw Error(fmt::format("--size '{}': give width and height up to 8192, such as 1280x720", text));
  }
  return size;
}

void SolverOptions::add_to(CLI::App& command) {
  command.add_option("--step", step, "Step h in seconds, such as 1/60 (the scene's)");
  command.add_option("--substeps", numbers.substeps, "Sub-steps n of A3 to A5")->capture_default_str();
  command.add_option("--iterations", iterations,
                     "Iterations m: of A2 in a step (10), of A3 to A5 in a sub-step (1)");
  command.add_option("--tau", numbers.tau, "Stabilization factor τ of A3 to A5")->capture_default_str();
  command.add_option("--kappa", numbers.kappa, "Stabilization factor κ of A3 to A5")->capture_default_str();
  command.add_option("--joints", joints, "Joints in A3 to A5: rows, plain (blocks) or stable (blocks)")
      ->capture_default_str();
  command.add_option("--duration", duration, "Seconds to simulate (the scene's)");
}

void SolverOptions::add_algorithm_to(CLI::App& command) {
  command.add_option("--algorithm", algorithm, "a1, a2, a3, a4 or a5")->capture_default_str();
  command.add_option("--relaxation", numbers.relaxation, "Over-relaxation ω of A2")->capture_default_str();
  command
      .add_option("--tolerance", numbers.tolerance,
                  "A2 ends a step when no row moves its velocity by more (m/s, rad/s); 0: never")
      ->capture_default_str();
}

Settings SolverOptions::settings(const Scene& scene) const {
  Settings result = numbers;
  const auto chosen = algorithm_named(algorithm);
  if (!chosen) throw Error(fmt::format("--algorithm '{}': give a1, a2, a3, a4 or a5", algorithm));
  result.algorithm = *chosen;
  result.iterations = iterations.value_or(default_settings(*chosen).iterations);
  const auto treatment = joints_named(joints);
  if (!treatment) throw Error(fmt::format("--joints '{}': give rows, plain or stable", joints));
  result.joints = *treatment;
  result.step = step ? seconds_in(*step, "--step") : scene.step;
  check(result);
  return result;
}

double SolverOptions::seconds(const Scene& scene) const {
  const double result = duration ? seconds_in(*duration, "--duration") : scene.duration;
  if (result < 0) throw Error(fmt::format("--duration '{}': must not be negative", *duration));
  return result;
}

int SolverOptions::steps(const Scene& scene, const Settings& settings) const {
  const double count = std::round(seconds(scene) / settings.step);
  constexpr double most = 10'000'000;
  if (!(count <= most)) {
    throw Error(fmt::format("{} steps of {} s are too many: ten million can be run", count, settings.step));
  }
  return static_cast<int>(count);
}

void note_cost_of_a1(const Scene& scene) {
  constexpr std::ptrdiff_t many = 1000;
  const std::ptrdiff_t bodies =
      std::ranges::count_if(scene.bodies, [](const Body& b) { return b.inverse_mass > 0; });
  if (bodies < many || scene.colliders.empty()) return;
  // Measured: 5,000 boxes in layers.
  fmt::print(stderr,
             "substep: note: A1 solves all contacts of {} bodies at once: where 5,000 boxes lie on one "
             "another a step "
             "takes 40 s and 1 GB; fewer bodies, a shorter --duration or another algorithm are quicker\n",
             bodies);
}

void SceneOptions::add_to(CLI::App& command) {
  command
      .add_option("scene", file,
                  "The scene, .gltf or .glb; or a mesh to drop on a plane: .obj, .stl, .ply, .dae, …")
      ->required();
  add_mesh_options_to(command);
}

void SceneOptions::add_mesh_options_to(CLI::App& command) {
  const std::string group = "For a mesh";
  command.add_option("--scale", scale_, "Metres in one unit of its file, such as 0.001 (1)")->group(group);
  command.add_option("--density", density_, "Its density in kg/m³ (1000)")->group(group);
  command.add_option("--mass", mass_, "Its mass in kg, in place of the density")->group(group);
  command.add_option("--height", height_, "Metres between the ground and its lowest point (half its size)")
      ->group(group);
  command.add_option("--rotate", rotation_, "Degrees about x, then y, then z, such as 30,0,45")
      ->delimiter(',')
      ->expected(3)
      ->group(group);
  command.add_option("--copies", copies_, "How many of it fall (1)")->group(group);
}

void SceneOptions::require_separate(const std::vector<GivenFile>& outputs) const {
  std::error_code none;
  const bool replaces =
      std::ranges::any_of(outputs, [&](const GivenFile& output) { return fs::exists(output.file, none); });
  std::vector<GivenFile> inputs;
  // What is not there yet is no input.
  if (replaces) {
    for (const fs::path& input : scene_files(file)) inputs.push_back({"what the scene is read from", input});
  }
  require_separate_files(inputs, outputs);
}

std::optional<MeshOptions> SceneOptions::mesh_options() const {
  if (!scale_ && !density_ && !mass_ && !height_ && !copies_ && rotation_.empty()) return std::nullopt;
  MeshOptions result;
  result.scale = scale_.value_or(result.scale);
  result.density = density_.value_or(result.density);
  result.mass = mass_;
  result.height = height_;
  result.copies = copies_.value_or(result.copies);
  if (rotation_.size() == 3) result.rotation = {rotation_[0], rotation_[1], rotation_[2]};
  return result;
}

Scene SceneOptions::load(const std::filesystem::path& other) const {
  Scene scene = load_scene(other, mesh_options());
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "substep: note: {}\n", warning);
  return scene;
}

}  // namespace substep
