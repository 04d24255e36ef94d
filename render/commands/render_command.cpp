#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/image.h"
#include "render/renderer.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"
#include "sim/simulation.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct RenderOptions {
  fs::path input;
  std::optional<fs::path> scene;
  std::vector<std::string> frames{"0"};
  std::string size = "1280x720";
  fs::path output = ".";
  SolverOptions solver;
  SceneOptions mesh;
};

bool is_pose_log(const fs::path& file) {
  constexpr std::string_view start = "substep pose log";
  std::string found(start.size(), ' ');
  std::ifstream stream(file, std::ios::binary);
  stream.read(found.data(), static_cast<std::streamsize>(found.size()));
  return stream.gcount() == static_cast<std::streamsize>(start.size()) && found == start;
}

/// The scene a log was made from, in the same version: its poses would not fit another.
Scene scene_of(const PoseLog& log, const RenderOptions& options) {
  const fs::path file = options.scene.value_or(options.input.parent_path() / log.scene);
  std::error_code ignored;
  if (!options.scene && !fs::exists(file, ignored)) {
    throw Error(fmt::format("{}: its scene {} is not beside it: name it with --scene FILE",
                            options.input.string(), log.scene));
  }
  Scene scene = options.mesh.load(file);
  if (scene.hash != log.scene_hash) {
    throw Error(fmt::format("{}: was made from another version of {}: run it again", options.input.string(),
                            file.string()));
  }
  if (scene.bodies.size() != log.bodies.size()) {
    throw Error(fmt::format("{}: has {} bodies, {} has {}", options.input.string(), log.bodies.size() - 1,
                            file.string(), scene.bodies.size() - 1));
  }
  return scene;
}

PoseLog simulated(const Scene& scene, const SolverOptions& solver, Progress& progress) {
  const Settings settings = solver.settings(scene);
  const int steps = solver.steps(scene, settings);
  Simulation simulation(scene, settings);
  return record(simulation, steps, 1, [&](int frame, const StepReport&) {
    progress.show("simulating", static_cast<double>(frame) / steps);
  });
}

/// The frames asked for, ascending. Each has poses.
std::vector<int> frames_of(const PoseLog& log, const std::vector<std::string>& asked) {
  std::vector<int> result;
  const int last = static_cast<int>(log.frames.size()) - 1;
  for (const std::string& text : asked) {
    if (text == "all") {
      for (int k = 0; k <= last; ++k) {
        if (!log.frames[static_cast<std::size_t>(k)].poses.empty()) result.push_back(k);
      }
      continue;
    }
    int frame = -1;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), frame);
    if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size() || frame < 0) {
      throw Error(fmt::format("--frame '{}': give a frame's number or 'all'", text));
    }
    if (frame > last) {
      throw Error(fmt::format("--frame {}: the last is {}{}", frame, last,
                              log.end == "ok" ? "" : ", the run " + log.end));
    }
    if (log.frames[static_cast<std::size_t>(frame)].poses.empty()) {
      throw Error(fmt::format("--frame {}: the log has poses every {} frames only: ask for {}", frame,
                              log.full_every, frame / log.full_every * log.full_every));
    }
    result.push_back(frame);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

void render(const RenderOptions& options) {
  const ImageSize size = image_size_in(options.size);
  Progress progress;
  PoseLog log;
  Scene scene;
  std::string stem;
  if (is_pose_log(options.input)) {
    log = read_pose_log(options.input);
    scene = scene_of(log, options);
    stem = options.input.filename().string();
    stem = stem.substr(0, stem.rfind(".poses.txt"));
  } else {
    if (options.scene) throw Error("--scene: is of use with a pose log only");
    scene = options.mesh.load(options.input);
    log = simulated(scene, options.solver, progress);
    stem = fmt::format("{}.{}", scene.name, name(log.settings.algorithm));
  }
  const std::vector<int> frames = frames_of(log, options.frames);
  const bool to_file = options.output.extension() == ".png";
  if (to_file && frames.size() != 1) {
    throw Error(fmt::format("{}: {} frames need a folder", options.output.string(), frames.size()));
  }
  std::error_code ignored;
  if (to_file) {
    require_folder_of(options.output);
    std::vector<GivenFile> inputs{{"the input", options.input}};
    if (options.scene) inputs.push_back({"--scene", *options.scene});
    require_separate_files(inputs, std::vector<GivenFile>{{"--output", options.output}});
  } else if (!fs::is_directory(options.output, ignored)) {
    throw Error(fmt::format("{}: there is no such folder", options.output.string()));
  }

  // For the camera of a scene without one: the same whichever frames are asked for.
  std::vector<std::vector<Coordinates>> all;
  for (const PoseLog::Frame& frame : log.frames) {
    if (!frame.poses.empty()) all.push_back(frame.poses);
  }
  RenderSettings settings;
  settings.width = size.width;
  settings.height = size.height;
  Renderer renderer(scene, settings, all);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Image image = renderer.draw(log.frames[static_cast<std::size_t>(frames[i])].poses);
    const fs::path file =
        to_file ? options.output : options.output / fmt::format("{}.f{:04d}.png", stem, frames[i]);
    write_png(image, file);
    if (frames.size() <= 8) fmt::print("wrote {}\n", file.string());
    progress.show("drawing", static_cast<double>(i + 1) / static_cast<double>(frames.size()));
  }
  if (frames.size() > 8) {
    fmt::print("wrote {} files {} to {}\n", frames.size(),
               (options.output / fmt::format("{}.f{:04d}.png", stem, frames.front())).string(),
               fmt::format("{}.f{:04d}.png", stem, frames.back()));
  }
}

}  // namespace

void add_render_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("render", "Draw frames of a scene or a pose log as PNG files");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("input", options->input, "A pose log, or a scene or mesh, which is simulated first")
      ->required();
  command->add_option("--scene", options->scene, "The scene of a pose log that is not in the log's folder");
  command->add_option("--frame", options->frames, "The frames' numbers, comma-separated, or 'all'")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  command->add_option("--output", options->output, "A folder, or for one frame a .png file")
      ->capture_default_str();
  options->solver.add_algorithm_to(*command);
  options->solver.add_to(*command);
  options->mesh.add_mesh_options_to(*command);
  command->footer(
      "Frame k is the state after k steps. A pose log has its own settings: those above are for a scene.\n"
      "Example:\n  substep render box_stack.a3.poses.txt --scene scenes/box_stack.gltf --frame 0,60,120");
  command->callback([options] { render(*options); });
}

}  // namespace substep
