#include <fmt/format.h>

#include <algorithm>
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
  std::vector<std::string> panels;
  std::optional<fs::path> panels_file;
  bool no_reference = false;
  double speed = 1;
  std::string start = "0";
  std::optional<std::string> end;
  std::vector<std::string> strips;
  std::string camera = "scene";
  std::vector<std::string> overlays;
  std::optional<fs::path> output;
  VideoSettings video;
};

std::string row_title(const Run& run) {
  std::string title = fmt::format("{}  {}", name_of(run.panel), settings_of(run.panel));
  if (!run.panel.title.empty()) title += "  " + run.panel.title;
  return title;
}

void print_table(const Comparison& comparison) {
  std::size_t width = 48;
  for (const Run& run : comparison.runs) width = std::max(width, row_title(run).size());
  fmt::print("{:<{}}{:>12}{:>12}{:>14}\n", "", width, "RMS error", "at the end", "row solves");
  for (const Run& run : comparison.runs) {
    if (run.is_reference()) continue;
    const std::string rms = run.errors.empty() ? "" : length_label(run.rms_error);
    const std::string final = run.errors.empty() ? "" : length_label(run.errors.back());
    fmt::print("{:<{}}{:>12}{:>12}{:>14}", row_title(run), width, rms, final,
               run.row_solves > 0 ? fmt::format("{}", run.row_solves) : "");
    if (run.diverged) fmt::print("  diverged at t = {:.3f} s", *run.diverged);
    if (run.unsolved > 0) fmt::print("  {} steps not solved to the accuracy asked for", run.unsolved);
    fmt::print("\n");
  }
  if (!comparison.reference) return;
  const ReferenceRun& reference = *comparison.reference;
  fmt::print("reference: {}", reference.method);
  if (reference.is_a1) fmt::print(" (the error of A1 is from its own smaller steps)");
  if (!reference.uncertainty.empty()) {
    fmt::print(", known to {}", length_label(*std::ranges::max_element(reference.uncertainty)));
  }
  if (reference.known == 0) {
    fmt::print("; {}: there are no errors\n", reference.fate);
  } else if (!reference.fate.empty()) {
    fmt::print("; {}: errors are those up to {:.2f} s\n", reference.fate,
               comparison.times[reference.known - 1]);
  } else {
    fmt::print("\n");
  }
}

/// The panels asked for, or the five and the reference.
void choose_panels(const VideoOptions& options, const Settings& base, VideoSettings& video) {
  std::vector<PanelChoice>& panels = video.comparison.panels;
  if (options.panels_file) {
    PanelFile file = read_panels(*options.panels_file, base);
    panels = std::move(file.panels);
    if (video.title.empty()) video.title = file.title;
  }
  for (const std::string& text : options.panels) panels.push_back(panel_in(text, base));
  if (panels.empty()) {
    panels = default_panels(base);
    if (options.no_reference) panels.pop_back();
  }
}

void make(VideoOptions& options) {
  const Scene scene = options.scene.load();
  VideoSettings& video = options.video;
  const Settings base = options.solver.settings(scene);
  choose_panels(options, base, video);
  video.comparison.step = base.step;
  video.comparison.has_reference = !options.no_reference;
  // The reference of contacts is A1 itself.
  const bool has_a1 = std::ranges::any_of(video.comparison.panels, [](const PanelChoice& panel) {
    return panel.kind == PanelChoice::Kind::algorithm && panel.settings.algorithm == Algorithm::a1;
  });
  if (has_a1 || video.comparison.has_reference) note_cost_of_a1(scene);
  video.comparison.start = seconds_in(options.start, "--start");
  video.comparison.duration = options.solver.seconds(scene);
  if (options.end) {
    const double end = seconds_in(*options.end, "--end");
    if (!(end >= video.comparison.start && end <= video.comparison.duration)) {
      throw Error(
          fmt::format("--end {}: must be from --start to the end of the run, {:g} s (--duration "
                      "makes it longer)",
                      *options.end, video.comparison.duration));
    }
    video.comparison.duration = end;
  }
  video.comparison.frame_interval = options.speed / video.frame_rate;
  video.comparison.threads = video.threads;
  video.camera = camera_named(options.camera, scene);
  video.overlays = overlays_named(options.overlays);
  if (!options.strips.empty()) video.strips = strips_named(options.strips);
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
  if (video.output.extension() == ".png" && !video.frames) {
    video.frames = video.output;
    video.frames->replace_extension();
    video.output.replace_extension(".mp4");
  }
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
    fmt::print(
        "the step does not divide the {:g} s between frames: each shows the step nearest to its time\n",
        video.comparison.frame_interval);
  }
  fmt::print("CPU time: simulate {:.1f} s, draw {:.1f} s, encode {:.1f} s\n", report.cpu.simulating,
             report.cpu.drawing, report.cpu.encoding);
  fmt::print("wrote {}\n", report.written.string());
  if (!report.is_film) {
    if (!video.frames) fmt::print("ffmpeg is not in PATH: the frames are there as PNG files\n");
    fmt::print("a film of them: {}\n", report.film_command);
  }
  for (const auto& file : {video.poster, video.loop}) {
    if (file) fmt::print("wrote {}\n", file->string());
  }
}

/// What is filmed.
void add_panel_options(CLI::App& command, VideoOptions& options) {
  command
      .add_option(
          "--panel", options.panels,
          "A panel of its own: a1 to a5, an engine, log:FILE or reference; once for each (A1 to A5 and "
          "the reference)")
      ->allow_extra_args(false);
  command.add_option("--panels", options.panels_file, "A TOML file of [[panel]] tables")
      ->check(CLI::ExistingFile);
  command.add_option("--title", options.video.title, "The film's (the scene's name)");
  command.add_flag("--no-reference", options.no_reference, "Simulate none, and show no errors");
  command
      .add_option("--reference-substeps", options.video.comparison.reference_substeps,
                  "The reference is at the step divided by this, its check at half as many")
      ->capture_default_str();
}

/// How it is shown.
void add_look_options(CLI::App& command, VideoOptions& options) {
  command
      .add_option("--overlay", options.overlays,
                  "Comma-separated: trails (of the last second), joints (and the gaps where they are open), "
                  "ghost (the reference's outline), contacts (and their impulses), and bodies in the colour "
                  "of error, penetration or velocity")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option("--strip", options.strips,
                  "Comma-separated, below each picture: error (from the reference; what there is unless "
                  "told otherwise), energy (since the start), gap (the largest of a joint)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_flag(
      "--freeze", options.video.freezes,
      "Stand still where a run first leaves the reference, by 2 % of the scene's size, with a ring "
      "round the body");
  command
      .add_option("--camera", options.camera,
                  "scene (its first), name:CAMERA, fit (all that moves), follow:BODY or orbit:DEGREES in a "
                  "second of film")
      ->capture_default_str();
  command.add_option("--start", options.start, "Seconds into the run at which the film begins")
      ->capture_default_str();
  command.add_option("--end", options.end, "Seconds into the run at which it ends (the duration)");
  command
      .add_option("--speed", options.speed, "Seconds of the scene in a second of film: 0.25 is slow motion")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  command.add_option("--fps", options.video.frame_rate, "Frames in a second of film")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
}

}  // namespace

void add_video_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand(
      "video", "Film a scene: algorithms, engines and finished runs side by side, with their errors");
  const auto options = std::make_shared<VideoOptions>();
  VideoSettings& video = options->video;
  options->scene.add_to(*command);
  options->solver.add_to(*command);
  add_panel_options(*command, *options);
  command->add_option("--size", options->size, "Width and height in pixels")->capture_default_str();
  add_look_options(*command, *options);
  command->add_option(
      "--output", options->output,
      "The film: .mp4, .webm, .gif or .apng, or NAME.png for a folder NAME of numbered pictures "
      "(SCENE.mp4)");
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
      "A panel is 'a5,n=4,joints=stable', with what is to be other than the options above of n, m, tau, "
      "kappa,\n"
      "joints, relaxation, step and, last, title; A2 has n·m iterations unless it has an m. The strip under "
      "a\n"
      "picture is the RMS distance of the bodies' points from where the reference has them, on one "
      "logarithmic\n"
      "scale; it ends where the reference does, and is grey below what the reference knows of itself.\n"
      "Example:\n  substep video scenes/rod_chain.gltf --substeps 4 --joints stable --poster rod_chain.png\n"
      "  substep video scenes/heavy_chain.gltf --panel a5,n=1 --panel a5,n=4 --panel bullet\n"
      "  substep video scenes/box_stack.gltf --overlay contacts,velocity --strip error,energy --start 0.5 "
      "--end 2");
  command->callback([options] { make(*options); });
}

}  // namespace substep
