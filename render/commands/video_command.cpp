#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/commands/commands.h"
#include "render/video/composition.h"
#include "render/video/video.h"
#include "sim/commands/options.h"
#include "sim/commands/progress.h"
#include "sim/error.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

struct VideoOptions {
  SceneOptions scene;
  SolverOptions solver;
  std::string size = "1280x720";
  std::optional<fs::path> output;
  VideoSettings video;
};

void print_table(const Comparison& comparison) {
  fmt::print("{:<48}{:>12}{:>12}{:>14}\n", "", "RMS error", "at the end", "row solves");
  for (const Run& run : comparison.runs) {
    std::string title = (run.is_reference ? "reference: " : "") + label(run.settings);
    const std::string rms = run.is_reference ? "" : length_label(run.rms_error);
    const std::string final = run.is_reference || run.errors.empty() ? "" : length_label(run.errors.back());
    fmt::print("{:<48}{:>12}{:>12}{:>14}", title, rms, final, run.row_solves);
    if (run.diverged) fmt::print("  diverged at t = {:.3f} s", *run.diverged);
    if (run.unsolved > 0) fmt::print("  {} steps not solved to the accuracy asked for", run.unsolved);
    fmt::print("\n");
  }
}

void make(VideoOptions& options) {
  const Scene scene = options.scene.load();
  note_cost_of_a1(scene);
  VideoSettings& video = options.video;
  video.comparison.settings = options.solver.settings(scene);
  video.comparison.duration = options.solver.seconds(scene);
  video.comparison.threads = video.threads;
  if (!(video.threads >= 1 && video.threads <= 64)) {
    throw Error(fmt::format("--threads {}: must be from 1 to 64", video.threads));
  }
  // What CLI11 compares with a range may be no number.
  if (std::isnan(video.hold)) throw Error("--hold nan: must be from 0 to 60 s");
  if (video.poster_time && !std::isfinite(*video.poster_time)) {
    throw Error(fmt::format("--poster-time {}: give seconds", *video.poster_time));
  }
  const ImageSize size = image_size_in(options.size);
  video.width = size.width;
  video.height = size.height;
  video.output = options.output.value_or(scene.name + ".mp4");
  if (video.loop && video.loop->extension() != ".gif") {
    throw Error(fmt::format("--loop {}: must be a .gif file", video.loop->string()));
  }
  std::vector<GivenFile> outputs{{"--output", video.output}};
  for (const auto& [role, file] : {std::pair("--frames", video.frames), std::pair("--poster", video.poster),
                                   std::pair("--loop", video.loop)}) {
    if (file) outputs.push_back({role, *file});
  }
  options.scene.require_separate(outputs);

  VideoReport report;
  {
    Progress progress;
    video.progress = [&progress](std::string_view stage, double share) { progress.show(stage, share); };
    report = make_video(scene, video);
  }
  print_table(report.comparison);
  if (report.comparison.is_nearest) {
    fmt::print("the step does not divide 1/{} s: each frame shows the step nearest to its time\n",
               video_frame_rate);
  }
  fmt::print("wrote {}\n", report.written.string());
  if (!report.is_film) {
    if (!video.frames) fmt::print("ffmpeg is not in PATH: the frames are there as PNG files\n");
    fmt::print("a film of them: {}\n", report.film_command);
  }
  for (const auto& file : {video.poster, video.loop}) {
    if (file) fmt::print("wrote {}\n", file->string());
  }
}

}  // namespace

void add_video_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("video", "Film a scene: A1 to A5 and a reference side by side, with their errors");
  const auto options = std::make_shared<VideoOptions>();
  VideoSettings& video = options->video;
  options->scene.add_to(*command);
  options->solver.add_to(*command);
  command
      ->add_option("--reference-substeps", video.comparison.reference_substeps,
                   "The reference is A1 at the step divided by this")
      ->capture_default_str();
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  command->add_option("--output", options->output, "The film (SCENE.mp4)");
  command->add_option("--frames", video.frames, "A folder for PNG frames, instead of the film");
  command->add_option("--poster", video.poster, "Also write one frame as a PNG file");
  command->add_option("--poster-time", video.poster_time, "Which one, in seconds (well into the film)")
      ->check(CLI::NonNegativeNumber)
      ->needs("--poster");
  command->add_option("--loop", video.loop, "Also write a small loop as a GIF file, below 2 MB");
  command->add_option("--hold", video.hold, "Seconds for which the last frame stays")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--threads", video.threads, "Threads; the film is the same for any number")
      ->capture_default_str();
  command->footer(
      "A2 has n·m iterations, as many row solves as A3 to A5. The strip under each picture is the RMS\n"
      "distance of the bodies' points from where the reference has them, on one logarithmic scale.\n"
      "Example:\n  substep video scenes/rod_chain.gltf --substeps 4 --joints stable --poster rod_chain.png");
  command->callback([options] { make(*options); });
}

}  // namespace substep
