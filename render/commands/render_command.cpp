#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/run_input.h"
#include "render/image.h"
#include "render/renderer.h"
#include "sim/commands/options.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/pose_log.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct RenderOptions {
  RunInput run;
  std::vector<std::string> frames{"0"};
  std::string size = "1280x720";
  fs::path output = ".";
};

int frame_in(const std::string& text) {
  int frame = -1;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), frame);
  if (parsed.ec != std::errc{} || parsed.ptr != text.data() + text.size() || frame < 0) {
    throw Error(fmt::format("--frame '{}': give a frame's number or 'all'", text));
  }
  return frame;
}

/// The last frame that is named; nothing where all are asked for.
std::optional<int> last_named(const std::vector<std::string>& asked) {
  int last = 0;
  for (const std::string& text : asked) {
    if (text == "all") return std::nullopt;
    last = std::max(last, frame_in(text));
  }
  return last;
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
    const int frame = frame_in(text);
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
  RenderSettings settings;
  const ImageSize size = image_size_in(options.size);
  settings.width = size.width;
  settings.height = size.height;
  check(settings);
  Progress progress;
  const auto [scene, log, stem] = options.run.load(last_named(options.frames), progress);
  const std::vector<int> frames = frames_of(log, options.frames);
  const bool to_file = options.output.extension() == ".png";
  if (to_file && frames.size() != 1) {
    throw Error(fmt::format("{}: {} frames need a folder", options.output.string(), frames.size()));
  }
  std::error_code ignored;
  if (to_file) {
    require_folder_of(options.output);
    options.run.require_separate(options.output);
  } else if (!fs::is_directory(options.output, ignored)) {
    throw Error(fmt::format("{}: there is no such folder", options.output.string()));
  }

  // For the camera of a scene without one: what moves until the last of the frames.
  std::vector<std::vector<Coordinates>> seen;
  for (int k = 0; k <= frames.back(); ++k) {
    const PoseLog::Frame& frame = log.frames[static_cast<std::size_t>(k)];
    if (!frame.poses.empty()) seen.push_back(frame.poses);
  }
  Renderer renderer(scene, settings, seen);
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
  command->add_option("--frame", options->frames, "The frames' numbers, comma-separated, or 'all'")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  command->add_option("--output", options->output, "A folder, or for one frame a .png file")
      ->capture_default_str();
  command->footer(
      "Frame k is the state after k steps; no more are simulated than the last one asked for needs. A pose "
      "log has its own settings: those above are for a scene.\n"
      "Example:\n  substep render box_stack.a3.poses.txt --scene scenes/box_stack.gltf --frame 0,60,120");
  command->callback([options] { render(*options); });
}

}  // namespace substep
