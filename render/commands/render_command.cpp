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
#include "render/commands/render_layouts.h"
#include "render/image.h"
#include "render/renderer.h"
#include "render/video/film_camera.h"
#include "sim/commands/options.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

int frame_in(const std::string& text) {
  int frame = -1;
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, frame);
  if (parsed.ec != std::errc{} || parsed.ptr != end || frame < 0)
    throw Error("--frame '{}': give a frame's number or 'all'", text);
  return frame;
}

double time_in(const std::string& text) {
  const double time = seconds_in(text, "--time");
  if (!(time >= 0)) throw Error("--time '{}': must not be negative", text);
  return time;
}

/// Returns the end of the run that the chosen pictures need.
RunEnd last_of(const RenderOptions& options) {
  RunEnd end;
  for (const std::string& text : options.frames) {
    if (text == "all") return {};
    end.frame = std::max(end.frame.value_or(0), frame_in(text));
  }
  for (const std::string& text : options.times) end.time = std::max(end.time.value_or(0), time_in(text));
  if (!end.frame && !end.time) end.frame = 0;
  return end;
}

/// Returns the frame nearest to a time among those with poses.
int frame_at(const PoseLog& log, double time) {
  const double moment = time / log.settings.step;
  const auto last = static_cast<double>(log.frames.size() - 1);
  if (!(moment < last + 0.5)) {
    throw Error("--time {:g}: the last frame is at {:g} s{}", time, last * log.settings.step,
                log.end == "ok" ? "" : ", the run " + log.end);
  }
  // Take the last frame, which always has poses, where it is nearer.
  const double frame = std::round(moment / log.full_every) * log.full_every;
  return static_cast<int>(std::abs(frame - moment) < std::abs(last - moment) ? frame : last);
}

/// Returns the frame's number. Throws Error where the log does not have it, or not its poses.
int require_frame(const PoseLog& log, int frame) {
  const int last = static_cast<int>(log.frames.size()) - 1;
  if (frame > last)
    throw Error("--frame {}: the last is {}{}", frame, last, log.end == "ok" ? "" : ", the run " + log.end);
  if (log.frames[static_cast<std::size_t>(frame)].poses.empty()) {
    throw Error("--frame {}: the log has poses every {} frames only: ask for {}", frame, log.full_every,
                frame / log.full_every * log.full_every);
  }
  return frame;
}

/// Returns the chosen frames, ascending. Each has poses.
std::vector<int> frames_of(const PoseLog& log, const RenderOptions& options) {
  std::vector<int> result;
  for (const std::string& text : options.frames) {
    if (text != "all") {
      result.push_back(require_frame(log, frame_in(text)));
      continue;
    }
    for (std::size_t k = 0; k < log.frames.size(); ++k)
      if (!log.frames[k].poses.empty()) result.push_back(static_cast<int>(k));
  }
  for (const std::string& text : options.times) result.push_back(frame_at(log, time_in(text)));
  if (result.empty()) result.push_back(0);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

LoadedRun load(const RenderOptions& options, Progress& progress) {
  if (!options.has_run_option) {
    if (std::optional<LoadedRun> still = options.run.load_still()) return std::move(*still);
  }
  return options.run.load(last_of(options), progress);
}

/// Draws these frames in one picture.
void draw_strobe(const RenderOptions& options, const fs::path& output, const LoadedRun& run,
                 const RenderSettings& settings, const std::vector<int>& frames) {
  if (frames.size() < 2)
    throw Error("--layout strobe: needs at least two moments: give --time 0,0.2,0.4 or --frame");
  std::vector<std::vector<Coordinates>> moments;
  for (const int frame : frames) moments.push_back(run.log.frames[static_cast<std::size_t>(frame)].poses);
  const Image image =
      strobe(seen_by(still_camera_named(options.camera, run.scene), run.scene), settings, moments);
  const fs::path file = output.extension() == ".png" ? output : output / (run.stem + ".strobe.png");
  write_png(image, file);
  fmt::print("wrote {}\n", file.string());
}

/// Throws Error where the output cannot be written: one file for several pictures, or no folder.
void require_output(const RenderOptions& options, const fs::path& output, std::size_t pictures) {
  if (output.extension() != ".png") {
    std::error_code ignored;
    if (fs::is_directory(output, ignored)) return;
    throw Error("{}: there is no such folder, and a picture's name ends in .png", output.string());
  }
  if (pictures != 1) throw Error("{}: {} frames need a folder", output.string(), pictures);
  require_folder_of(output);
  options.run.require_separate(output);
}

/// Draws a picture of each of these frames.
void draw_frames(const RenderOptions& options, const fs::path& output, const LoadedRun& run,
                 const RenderSettings& settings, const std::vector<int>& frames, Progress& progress) {
  const Scene& scene = run.scene;
  const PoseLog& log = run.log;
  // Collect the poses up to the last frame for the camera of a scene without one.
  std::vector<std::vector<Coordinates>> seen;
  for (int k = 0; k <= frames.back(); ++k) {
    const PoseLog::Frame& frame = log.frames[static_cast<std::size_t>(k)];
    if (!frame.poses.empty()) seen.push_back(frame.poses);
  }
  Renderer renderer(seen_by(still_camera_named(options.camera, scene), scene), settings, seen);
  const auto name_of_frame = [&](int frame) { return fmt::format("{}.f{:04d}.png", run.stem, frame); };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Image image = renderer.draw(log.frames[static_cast<std::size_t>(frames[i])].poses);
    const fs::path file = output.extension() == ".png" ? output : output / name_of_frame(frames[i]);
    write_png(image, file);
    if (frames.size() <= 8) fmt::print("wrote {}\n", file.string());
    progress.show("drawing", static_cast<double>(i + 1) / static_cast<double>(frames.size()));
  }
  if (frames.size() > 8) {
    fmt::print("wrote {} files {} to {}\n", frames.size(), (output / name_of_frame(frames.front())).string(),
               name_of_frame(frames.back()));
  }
}

void draw_run(const RenderOptions& options) {
  const ImageSize size = image_size_in(options.size.value_or("1280x720"));
  const RenderSettings settings{.width = size.width, .height = size.height};
  check(settings);
  Progress progress;
  const LoadedRun run = load(options, progress);
  const std::vector<int> frames = frames_of(run.log, options);
  const bool is_strobe = options.layout == "strobe";
  const fs::path output = options.output.value_or(".");
  require_output(options, output, is_strobe ? 1 : frames.size());
  if (is_strobe) return draw_strobe(options, output, run, settings, frames);
  draw_frames(options, output, run, settings, frames, progress);
}

void render(RenderOptions& options) {
  options.run.file = options.inputs.front();
  if (options.layout == "sheet") return draw_sheet(options);
  if (options.inputs.size() > 1)
    throw Error("{}: is a second input: several are drawn with --layout sheet", options.inputs[1].string());
  if (options.layout == "stills") return draw_stills(options);
  draw_run(options);
}

constexpr const char* sheet_options = "With --layout sheet";
constexpr const char* stills_options = "With --layout stills";

void add_sheet_options(CLI::App& command, RenderOptions& options) {
  command.add_option("--columns", options.columns, "Pictures in a row")
      ->check(CLI::Range(1, 100))
      ->capture_default_str()
      ->group(sheet_options);
}

void add_stills_options(CLI::App& command, RenderOptions& options) {
  const std::vector<CLI::Option*> before = command.get_options();
  command.add_option("--title", options.comparison.title,
                     "Title above the pictures (default: that of --panels)");
  options.comparison.add_panels_to(command);
  command.add_option("--width", options.width,
                     "Width of the whole figure in print: one-column (85 mm), two-columns (178 mm) or a "
                     "number of mm; --size then gives only the pictures' shape");
  command.add_option("--dpi", options.dpi, "Pixels in an inch of print")
      ->check(number_from(50, 2400))
      ->capture_default_str();
  command.add_option("--text", options.text, "Text's size in print, points")
      ->check(number_from(4, 24))
      ->needs("--width")
      ->capture_default_str();
  for (CLI::Option* const option : command.get_options())
    if (std::ranges::find(before, option) == before.end()) option->group(stills_options);
}

/// Returns true where the layout, sheet or stills, ignores an option that other layouts read.
bool is_unread(const std::string& option, const std::string& layout) {
  if (layout == "stills") return option == "algorithm" || option == "frame" || option == "scene";
  return layout == "sheet" && (option == "frame" || option == "time" || option == "camera" ||
                               option == "scene" || option == "duration");
}

/// Throws Error where a typed option is for another layout. Notes in `options` whether one is for runs.
void check_options(const CLI::App& command, RenderOptions& options) {
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() == 0) continue;
    const std::string& group = option->get_group();
    const bool is_of_another = (group == sheet_options && options.layout != "sheet") ||
                               (group == stills_options && options.layout != "stills");
    if (is_of_another) throw Error("--{}: only {}", name, "w" + group.substr(1));
    if (is_unread(name, options.layout)) throw Error("--{}: not with --layout {}", name, options.layout);
    const bool is_of_picture =
        name == "inputs" || name == "size" || name == "output" || name == "camera" || name == "layout";
    options.has_run_option = options.has_run_option || !is_of_picture;
  }
}

}  // namespace

void add_render_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("render", "Draw moments of a run, or a sheet of many scenes, as PNG files");
  const auto options = std::make_shared<RenderOptions>();
  command->add_option("inputs", options->inputs, "A pose log, or a scene or mesh, which is simulated first")
      ->required();
  command
      ->add_option("--layout", options->layout,
                   "frames: a file for each moment; strobe: all moments in one picture, the earlier the "
                   "fainter; sheet: a labelled picture of each of several scenes; stills: a row for each "
                   "panel, a column for each time")
      ->check(CLI::IsMember({"frames", "strobe", "sheet", "stills"}))
      ->capture_default_str();
  command
      ->add_option("--frame", options->frames, "The frames' numbers, comma-separated, or 'all' (default: 0)")
      ->delimiter(',');
  command->add_option("--time", options->times, "Or their times in seconds: the nearest frames")
      ->delimiter(',');
  command
      ->add_option("--camera", options->camera,
                   "scene (its first), fit (all that moves) or name:CAMERA, another of the scene's")
      ->capture_default_str();
  command->add_option(
      "--size", options->size,
      "Width and height of a picture in pixels (default: 1280x720; 256x144 on a sheet, 640x360 of stills)");
  command->add_option("--output", options->output,
                      "A folder (default: .) or, for one picture, a .png file; a sheet's default is "
                      "sheet.png, that of stills SCENE.png, which may also be a .pdf");
  options->run.add_options_to(*command);
  add_sheet_options(*command, *options);
  add_stills_options(*command, *options);
  command->footer(
      "Frame k is the state after k steps; the simulation stops at the last frame that is asked for. A .gltf "
      "or .glb without physics is drawn as it stands, with its cameras; with --frame, --time or an option of "
      "the run it falls onto a plane. A sheet shows each scene at the 'poster' time of its extras, or else "
      "at half its duration.\n"
      "Example:\n  substep render box_stack.a3.poses.txt --scene scenes/box_stack.gltf --time 0,0.5,1\n"
      "  substep render scenes/pendulum.gltf --time 0,0.2,0.4,0.6,0.8 --layout strobe --size 7200x4050\n"
      "  substep render scenes/*.gltf --layout sheet --output sheet.png\n"
      "  substep render scenes/card_house.gltf --layout stills --panel a5 --panel bullet --time 0,0.5");
  command->callback([options, command] {
    check_options(*command, *options);
    render(*options);
  });
}

}  // namespace substep::render
