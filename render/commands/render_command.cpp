#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/run_input.h"
#include "render/image.h"
#include "render/renderer.h"
#include "render/strobe.h"
#include "render/video/film_camera.h"
#include "sim/commands/options.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct RenderOptions {
  RunInput run;
  std::vector<std::string> frames;  ///< neither these nor times: the first
  std::vector<std::string> times;
  bool asks_for_run = false;  ///< an option says something of one
  std::string camera = "scene";
  std::string size = "1280x720";
  fs::path output = ".";
  bool strobe = false;
};

int frame_in(const std::string& text) {
  int frame = -1;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), frame);
  if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size() || frame < 0) {
    throw Error(fmt::format("--frame '{}': give a frame's number or 'all'", text));
  }
  return frame;
}

double time_in(const std::string& text) {
  const double time = seconds_in(text, "--time");
  if (!(time >= 0)) throw Error(fmt::format("--time '{}': must not be negative", text));
  return time;
}

/// How far the run must go for what is asked for.
Until last_of(const RenderOptions& options) {
  Until until;
  for (const std::string& text : options.frames) {
    if (text == "all") return {};
    until.frame = std::max(until.frame.value_or(0), frame_in(text));
  }
  for (const std::string& text : options.times) {
    until.time = std::max(until.time.value_or(0), time_in(text));
  }
  if (!until.frame && !until.time) until.frame = 0;
  return until;
}

/// The frame that is nearest to a time among those with poses.
int frame_at(const PoseLog& log, double time) {
  const double spacing = log.settings.step * log.full_every;
  const double frame = std::round(time / spacing) * log.full_every;
  if (!(frame < static_cast<double>(log.frames.size()))) {
    throw Error(fmt::format("--time {:g}: the last frame is at {:g} s{}", time,
                            static_cast<double>(log.frames.size() - 1) * log.settings.step,
                            log.end == "ok" ? "" : ", the run " + log.end));
  }
  return static_cast<int>(frame);
}

/// A number among the log's frames, which has poses.
int require_frame(const PoseLog& log, int frame) {
  const int last = static_cast<int>(log.frames.size()) - 1;
  if (frame > last) {
    throw Error(fmt::format("--frame {}: the last is {}{}", frame, last,
                            log.end == "ok" ? "" : ", the run " + log.end));
  }
  if (log.frames[static_cast<std::size_t>(frame)].poses.empty()) {
    throw Error(fmt::format("--frame {}: the log has poses every {} frames only: ask for {}", frame,
                            log.full_every, frame / log.full_every * log.full_every));
  }
  return frame;
}

/// The frames asked for, ascending. Each has poses.
std::vector<int> frames_of(const PoseLog& log, const RenderOptions& options) {
  std::vector<int> result;
  for (const std::string& text : options.frames) {
    if (text != "all") {
      result.push_back(require_frame(log, frame_in(text)));
      continue;
    }
    for (std::size_t k = 0; k < log.frames.size(); ++k) {
      if (!log.frames[k].poses.empty()) result.push_back(static_cast<int>(k));
    }
  }
  for (const std::string& text : options.times) result.push_back(frame_at(log, time_in(text)));
  if (result.empty()) result.push_back(0);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

LoadedRun load(const RenderOptions& options, Progress& progress) {
  if (!options.asks_for_run) {
    if (std::optional<LoadedRun> still = options.run.load_still()) return std::move(*still);
  }
  return options.run.load(last_of(options), progress);
}

/// The picture of all these frames, or one of each.
void draw_strobe(const RenderOptions& options, const LoadedRun& run, const RenderSettings& settings,
                 const std::vector<int>& frames) {
  if (frames.size() < 2)
    throw Error("--strobe: needs at least two moments: give --time 0,0.2,0.4 or --frame");
  std::vector<std::vector<Coordinates>> moments;
  for (const int frame : frames) moments.push_back(run.log.frames[static_cast<std::size_t>(frame)].poses);
  const Image image =
      strobe(seen_by(still_camera_named(options.camera, run.scene), run.scene), settings, moments);
  const fs::path file =
      options.output.extension() == ".png" ? options.output : options.output / (run.stem + ".strobe.png");
  write_png(image, file);
  fmt::print("wrote {}\n", file.string());
}

void render(const RenderOptions& options) {
  RenderSettings settings;
  const ImageSize size = image_size_in(options.size);
  settings.width = size.width;
  settings.height = size.height;
  check(settings);
  Progress progress;
  const LoadedRun run = load(options, progress);
  const auto& [scene, log, stem] = run;
  const std::vector<int> frames = frames_of(log, options);
  const bool to_file = options.output.extension() == ".png";
  if (to_file && frames.size() != 1 && !options.strobe) {
    throw Error(fmt::format("{}: {} frames need a folder", options.output.string(), frames.size()));
  }
  std::error_code ignored;
  if (to_file) {
    require_folder_of(options.output);
    options.run.require_separate(options.output);
  } else if (!fs::is_directory(options.output, ignored)) {
    throw Error(fmt::format("{}: there is no such folder", options.output.string()));
  }

  if (options.strobe) {
    draw_strobe(options, run, settings, frames);
    return;
  }
  // For the camera of a scene without one: what moves until the last of the frames.
  std::vector<std::vector<Coordinates>> seen;
  for (int k = 0; k <= frames.back(); ++k) {
    const PoseLog::Frame& frame = log.frames[static_cast<std::size_t>(k)];
    if (!frame.poses.empty()) seen.push_back(frame.poses);
  }
  Renderer renderer(seen_by(still_camera_named(options.camera, scene), scene), settings, seen);
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
  options->run.add_to(*command);
  command->add_option("--frame", options->frames, "The frames' numbers, comma-separated, or 'all' (0)")
      ->delimiter(',');
  command->add_option("--time", options->times, "Or their times in seconds: the nearest frames")
      ->delimiter(',');
  command
      ->add_option("--camera", options->camera,
                   "scene (its first), fit (all that moves) or name:CAMERA, another of the scene's")
      ->capture_default_str();
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  command->add_option("--output", options->output, "A folder, or for one picture a .png file")
      ->capture_default_str();
  command->add_flag("--strobe", options->strobe, "All moments in one picture, the earlier the lighter");
  command->footer(
      "Frame k is the state after k steps; no more are simulated than the last one asked for needs. A pose "
      "log has its own settings: those above are for a scene. A .gltf or .glb without physics is drawn as it "
      "stands, with its cameras and lights; with --frame, --time or an option of the run it is dropped.\n"
      "Example:\n  substep render box_stack.a3.poses.txt --scene scenes/box_stack.gltf --time 0,0.5,1\n"
      "  substep render scenes/pendulum.gltf --time 0,0.2,0.4,0.6,0.8 --strobe --size 7200x4050\n"
      "  substep render chair.glb --camera name:front --output chair.png");
  command->callback([options, command] {
    for (const CLI::Option* option : command->get_options()) {
      const std::string name = option->get_single_name();
      const bool is_of_picture = name == "input" || name == "size" || name == "output" || name == "camera";
      options->asks_for_run = options->asks_for_run || (option->count() > 0 && !is_of_picture);
    }
    render(*options);
  });
}

}  // namespace substep::render
