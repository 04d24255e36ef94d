#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "render/commands/commands.h"
#include "render/commands/options.h"
#include "render/video/strips.h"
#include "render/video/video.h"
#include "sim/commands/output.h"
#include "sim/error.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

struct VideoOptions {
  ComparisonOptions comparison;
  std::string size = "1280x720";
  std::vector<std::string> strips;
  std::string camera = "scene";
  std::vector<std::string> overlays;
  std::optional<fs::path> output;
  VideoSettings video;
};

void make(VideoOptions& options) {
  const Scene scene = options.comparison.scene.load();
  VideoSettings& video = options.video;
  video.comparison = options.comparison.settings(scene);
  video.title = options.comparison.title;
  video.frame_rate = options.comparison.frame_rate;
  video.camera = camera_named(options.camera, scene);
  video.overlays = overlays_named(options.overlays);
  if (!options.strips.empty()) video.strips = strips_named(options.strips);
  const ImageSize size = image_size_in(options.size);
  video.width = size.width;
  video.height = size.height;
  video.output = options.output.value_or(scene.name + ".mp4");
  if (video.output.extension() == ".png" && !video.frames) {
    video.frames = video.output;
    video.frames->replace_extension();
    video.output.replace_extension(".mp4");
  }
  std::vector<GivenFile> outputs{{"--output", video.output}};
  for (const auto& [role, file] : {std::pair("--frames", video.frames), std::pair("--poster", video.poster),
                                   std::pair("--loop", video.loop)}) {
    if (file) outputs.push_back({role, *file});
  }
  options.comparison.scene.require_separate(outputs);
  for (const auto& [option, file, ending] :
       {std::tuple("--poster", video.poster, ".png"), {"--loop", video.loop, ".gif"}}) {
    if (file && file->extension() != ending)
      throw Error("{} {}: must be a {} file", option, file->string(), ending);
  }

  Progress progress;
  video.progress = [&progress](std::string_view stage, double fraction) { progress.show(stage, fraction); };
  const VideoReport report = make_video(scene, video);
  progress.clear();
  print_table(report.comparison, video.comparison.duration);
  warn_of(scene, report.comparison);
  fmt::print("wrote {}\n", video.frames.value_or(video.output).string());
  if (!report.film_command.empty()) fmt::print("to make a film of these frames: {}\n", report.film_command);
  for (const auto& file : {video.poster, video.loop}) {
    if (file) fmt::print("wrote {}\n", file->string());
  }
}

/// Adds the options of overlays, strips and the camera.
void add_picture_options(CLI::App& command, VideoOptions& options) {
  command
      .add_option("--overlay", options.overlays,
                  "Comma-separated: trails (of the last second), joints (and the gaps where they are open), "
                  "ghost (the reference's outline), contacts (and their impulses, of A1 to A5), and bodies "
                  "in the colour "
                  "of error, penetration or velocity")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option(
          "--strip", options.strips,
          "Comma-separated, below each picture: error (from the reference), expected (what the scene "
          "expects), gap (the largest joint gap), depth (the deepest penetration), energy (since "
          "the start, but of no pose log). Default: error where the reference holds for half of the film, "
          "else the first of the others, in this order, that the scene has; none with --no-reference")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_flag(
      "--freeze", options.video.freezes,
      "Stand still where a run first differs from the reference by more than 2 % of the scene's size, "
      "with a ring round the body");
  command
      .add_option("--camera", options.camera,
                  "scene (its first), name:CAMERA, fit (all that moves), follow:BODY or orbit:DEGREES in a "
                  "second of film")
      ->capture_default_str();
}

}  // namespace

void add_video_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "video", "Film a scene: algorithms, engines and finished runs side by side, with their errors");
  const auto options = std::make_shared<VideoOptions>();
  VideoSettings& video = options->video;
  options->comparison.scene.add_to(*command);
  command->add_option("--title", options->comparison.title, "What stands above all (the scene's name)");
  options->comparison.add_settings_to(*command);
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  add_picture_options(*command, *options);
  command->add_option(
      "--output", options->output,
      "The film: .mp4, .webm, .gif or .apng, or NAME.png for a folder NAME of numbered pictures "
      "(default: SCENE.mp4)");
  command->add_option("--frames", video.frames, "A folder for PNG frames, instead of the film");
  command->add_option("--poster", video.poster, "Also write one frame, well into the film, as a PNG file");
  command->add_option("--loop", video.loop, "Also write a small loop as a GIF file, below 2 MB");
  command->add_option("--hold", video.hold, "Seconds for which the last frame stays")
      ->check(number_from(0, 60))
      ->capture_default_str();
  command->footer(
      "A panel is an algorithm or engine, then settings that differ from the options above, as --set takes "
      "them, then title=…: 'a5,n=4,joints=stable'. Engines make n·m iterations unless the panel sets m; so "
      "do A2 and AVBD where n or m is given. The strip of errors is the RMS distance of the bodies' points "
      "from where the reference has them; it ends where the reference does, and is grey below the "
      "reference's uncertainty. Frames between two steps are interpolated.\n"
      "Example:\n  substep video scenes/rod_chain.gltf --substeps 4 --set joints=stable --poster "
      "rod_chain.png\n"
      "  substep video scenes/heavy_chain.gltf --panel a5,n=1 --panel a5,n=4 --panel bullet\n"
      "  substep video scenes/box_stack.gltf --overlay contacts,velocity --strip error,energy --start 0.5 "
      "--end 2");
  command->callback([options] { make(*options); });
}

}  // namespace substep::render
