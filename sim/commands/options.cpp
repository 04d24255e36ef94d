#include "sim/commands/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "sim/error.h"
#include "sim/model/usual_settings.h"
#include "sim/study/sweep.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

constexpr const char* solving = "Solving ('substep help settings')";

constexpr double longest_usual_step = 0.25;  // s: a longer one is more likely a rate

}  // namespace

double seconds_in(const std::string& text, const std::string& option) {
  const auto value = fraction_in(text);
  if (!value) throw Error("{} '{}': give seconds, such as 0.01 or 1/60", option, text);
  return *value;
}

std::optional<std::pair<int, int>> two_numbers_in(std::string_view text, char separator) {
  std::pair<int, int> numbers;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, numbers.first);
  if (first.ec != std::errc{} || first.ptr == end || *first.ptr != separator) return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, numbers.second);
  if (second.ec != std::errc{} || second.ptr != end) return std::nullopt;
  return numbers;
}

ImageSize image_size_in(const std::string& text) {
  const auto [width, height] = two_numbers_in(text, 'x').value_or(std::pair(0, 0));
  if (std::min(width, height) < 1 || std::max(width, height) > 32768)
    throw Error("--size '{}': give width and height up to 32768, such as 1280x720", text);
  return {width, height};
}

void SolverOptions::add_to(CLI::App& command) {
  command.add_option("--step", step_, "Step h in seconds, such as 1/60 (the scene's)")->group(solving);
  command.add_option("--substeps", substeps_, "Sub-steps n of A3 to A5 (the scene's), Soft Step: 4")
      ->group(solving);
  command
      .add_option("--set", set_,
                  "Any setting, as labels print it: n=4,joints=stable,tau=0.6/0.9; 'substep help settings' "
                  "explains them")
      ->allow_extra_args(false)
      ->group(solving);
  command.add_option("--duration", duration, "Seconds to simulate")
      ->default_str("the scene's")
      ->group(solving);
}

void SolverOptions::add_algorithm_to(CLI::App& command) {
  command
      .add_option("--algorithm", algorithm_, "a1, a2, a3, a4 or a5; soft or avbd, which are not the report's")
      ->default_str(std::string(name(Settings{}.algorithm)))
      ->group(solving);
}

TypedSettings SolverOptions::in_set() const {
  TypedSettings typed;
  for (const std::string& text : set_) {
    for (auto& setting : typed_settings_in(text)) typed.push_back(std::move(setting));
  }
  return typed;
}

bool SolverOptions::has(std::string_view field) const {
  return (field == "step" && step_) || (field == "substeps" && substeps_) || is_in_set(field);
}

bool SolverOptions::is_in_set(std::string_view field) const {
  return std::ranges::any_of(
      in_set(), [&](const auto& setting) { return is_called(field_named(field), setting.first); });
}

void SolverOptions::apply_to(Settings& settings) const {
  std::vector<const SettingsField*> fields;
  for (const SettingsField& field : settings_fields) {
    if (field.name != "algorithm") fields.push_back(&field);
  }
  try {
    set_typed(settings, in_set(), fields);
  } catch (const Error& error) {
    throw Error("--set {}", error.what());
  }
  for (const auto& [name, text] :
       {std::pair("algorithm", algorithm_), {"step", step_}, {"substeps", substeps_}}) {
    const SettingsField& field = field_named(name);
    if (text && is_in_set(name)) throw Error("--{0} '{1}': --set gives {0} too: give one", name, *text);
    if (!text || set_typed(settings, field, *text)) continue;
    const bool is_number = std::holds_alternative<double Settings::*>(field.member);
    throw Error("--{} '{}': give {}{}", name, *text, kind_of(field),
                is_number ? ", such as 0.01 or 1/60" : "");
  }
  const double longest = field_named("step").range.high;
  if (step_ && settings.step > longest) {
    throw Error(
        "--step {}: is a step of {:g} s, and must be at most {:g} s: sixty steps a second are --step 1/60",
        *step_, settings.step, longest);
  }
}

Settings SolverOptions::settings(const Scene& scene, Algorithm algorithm) const {
  Settings settings = usual_settings(scene, algorithm);
  apply_to(settings);
  return settings;
}

Settings SolverOptions::settings(const Scene& scene) const {
  Settings typed;
  apply_to(typed);
  const Settings result = settings(scene, typed.algorithm);
  check(result);
  for (const SettingsField& field : settings_fields) {
    if (has(field.name) && !field.is_read_by(result.algorithm))
      fmt::print(stderr, "substep: note: {} does not read {}\n", title_of(result.algorithm), field.name);
  }
  if (step_ && result.step > longest_usual_step) {
    fmt::print(stderr, "substep: note: --step {} is a step of {:g} s: sixty steps a second are --step 1/60\n",
               *step_, result.step);
  }
  return result;
}

double SolverOptions::seconds(const Scene& scene) const {
  const double result = duration ? seconds_in(*duration, "--duration") : scene.duration;
  if (result < 0) throw Error("--duration '{}': must not be negative", *duration);
  return result;
}

int SolverOptions::steps(const Scene& scene, const Settings& settings) const {
  const double count = std::round(seconds(scene) / settings.step);
  constexpr double most = 10'000'000;
  if (!(count <= most))
    throw Error("{} steps of {} s are too many: ten million can be run", count, settings.step);
  return static_cast<int>(count);
}

void CacheOption::add_to(CLI::App& command) {
  command.add_flag("--no-cache", is_off,
                   "Compute references, and keep none in $XDG_CACHE_HOME/substep (~/.cache/substep)");
}

void note_cost_of_a1(const Scene& scene) {
  constexpr std::ptrdiff_t many = 1000;
  const std::ptrdiff_t bodies =
      std::ranges::count_if(scene.bodies, [](const Body& b) { return b.inverse_mass > 0; });
  if (bodies < many || scene.colliders.empty()) return;
  fmt::print(
      stderr,
      "substep: note: A1 solves all contacts of {} bodies at once: its time and memory grow faster than "
      "their number; fewer bodies, a shorter --duration or another algorithm are quicker\n",
      bodies);
}

void note_damaged_jobs(const Sweep& sweep, const std::filesystem::path& results) {
  for (const std::filesystem::path& file : damaged_jobs(sweep, results))
    fmt::print(stderr, "substep: note: {}: is damaged: it is measured again\n", file.string());
}

void note_omitted_runs(const std::vector<SweepRecord>& records) {
  const auto is_omitted = [](const SweepRecord& record) { return !record.omitted.empty(); };
  const auto first = std::ranges::find_if(records, is_omitted);
  if (first == records.end()) return;
  fmt::print(stderr, "substep: note: {} of {} runs are omitted; the first is {}: {}\n",
             std::ranges::count_if(records, is_omitted), records.size(), first->key, first->omitted);
}

void SceneOptions::add_to(CLI::App& command) {
  command
      .add_option("scene", file,
                  "The scene, .gltf or .glb; or a mesh to drop on a plane: .obj, .stl, .ply, .dae, …")
      ->required();
  add_mesh_options_to(command);
}

void SceneOptions::add_mesh_options_to(CLI::App& command) {
  options_of_mesh_ = {
      command.add_option("--scale", mesh_.scale, "Metres in one unit of its file, such as 0.001 (1)"),
      command.add_option("--density", mesh_.density, "Its density in kg/m³ (1000)"),
      command.add_option("--mass", mesh_.mass, "Its mass in kg, in place of the density"),
      command.add_option("--height", mesh_.height,
                         "Metres between the ground and its lowest point (half its size)"),
      command.add_option("--rotate", rotation_, "Degrees about x, then y, then z, such as 30,0,45")
          ->delimiter(',')
          ->expected(3),
      command.add_option("--copies", mesh_.copies, "How many of it fall (1)")};
  for (CLI::Option* const option : options_of_mesh_) option->group("For a mesh");
  command.get_option("--mass")->excludes("--density");
}

void SceneOptions::require_separate(const std::vector<GivenFile>& outputs) const {
  std::error_code none;
  const bool replaces =
      std::ranges::any_of(outputs, [&](const GivenFile& output) { return fs::exists(output.file, none); });
  std::vector<GivenFile> inputs;
  // A file that does not exist yet is no input.
  if (replaces) {
    for (const fs::path& input : scene_files(file)) inputs.push_back({"what the scene is read from", input});
  }
  require_separate_files(inputs, outputs);
}

std::optional<MeshOptions> SceneOptions::mesh_options() const {
  const auto is_typed = [](const CLI::Option* option) { return option->count() > 0; };
  if (std::ranges::none_of(options_of_mesh_, is_typed)) return std::nullopt;
  MeshOptions result = mesh_;
  if (!rotation_.empty()) result.rotation = Vector3(rotation_.data());
  return result;
}

Scene SceneOptions::load(const std::filesystem::path& other) const {
  Scene scene = load_scene(other, mesh_options());
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "substep: note: {}\n", warning);
  return scene;
}

}  // namespace substep
