#include "render/video/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "render/image.h"
#include "render/renderer.h"
#include "render/video/composition.h"
#include "render/video/ffmpeg.h"
#include "render/video/frame_queue.h"
#include "render/video/seen_frames.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/log/partial_file.h"

namespace substep {
namespace {

namespace fs = std::filesystem;

/// The run's poses at film frame k; where it diverged before, its last.
std::vector<Coordinates> poses_at(const Scene& scene, const Run& run, std::size_t k) {
  if (run.poses.empty()) return initial_state(scene).q;
  std::vector<Coordinates> poses = run.poses[std::min(k, run.poses.size() - 1)];
  for (Coordinates& pose : poses) {
    // What flies off far beyond sight would overflow the renderer's single precision.
    constexpr double far = 1e5;
    pose.linear = pose.linear.cwiseMax(-far).cwiseMin(far);
  }
  return poses;
}

/// Where the camera of a run is at frame k.
View view_at(const View& view, const Scene& scene, const VideoSettings& settings,
             const Comparison& comparison, const Run& run, std::size_t k) {
  const auto body = static_cast<std::size_t>(settings.camera.follows);
  Vector3 way = Vector3::Zero();
  if (!run.poses.empty()) {
    way = run.poses[std::min(k, run.poses.size() - 1)][body].linear - run.poses.front()[body].linear;
  }
  Vector3 middle = Vector3::Zero();
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) middle += scene.bodies[i].pose.position;
  middle /= static_cast<double>(std::max<std::size_t>(1, scene.bodies.size() - 1));
  // A second of film is as many frames as its rate says.
  const double seconds = static_cast<double>(k) / settings.frame_rate;
  return moved(view, settings.camera, way, std::min(seconds, static_cast<double>(comparison.times.size())),
               middle);
}

/// One panel's picture at film frame k, with its overlays.
Image panel_picture(Renderer& renderer, const Scene& scene, const VideoSettings& settings,
                    const Comparison& comparison, const Run& run, std::size_t k) {
  const std::vector<Coordinates> poses = poses_at(scene, run, k);
  Image picture = renderer.draw(poses);
  if (!settings.overlays.any() || run.is_reference()) return picture;
  const ErrorScale scale = error_scale(comparison);
  const bool is_known = comparison.reference && k < comparison.reference->known;
  OverlayFrame frame{scene, renderer.view(), run};
  frame.k = k;
  frame.trail = static_cast<std::size_t>(std::max(1L, std::lround(settings.frame_rate)));
  frame.lower = scale.lower;
  frame.upper = scale.upper;
  Image bodies;
  Image reference_bodies;
  if (is_known) {
    frame.reference = &*comparison.reference;
    if (settings.overlays.error) {
      bodies = renderer.draw_bodies(poses);
      frame.bodies = &bodies;
    }
    if (settings.overlays.ghost) {
      reference_bodies = renderer.draw_bodies(comparison.reference->poses[k]);
      frame.reference_bodies = &reference_bodies;
    }
  }
  draw_overlays(picture, settings.overlays, frame);
  return picture;
}

/// Paints film frames of this size; `every` of the comparison's frames is painted, the others are left out.
std::function<Painter()> painters(const Scene& scene, const VideoSettings& settings,
                                  const Comparison& comparison, const Composition& composition, int every) {
  return [&scene, &settings, &comparison, &composition, every]() -> Painter {
    RenderSettings pictures_settings;
    pictures_settings.width = composition.picture_width();
    pictures_settings.height = composition.picture_height();
    pictures_settings.steps_back = true;
    Scene seen = scene;
    if (settings.camera.is_automatic) seen.camera.reset();
    auto renderer = std::make_shared<Renderer>(seen, pictures_settings, seen_frames(scene, comparison));
    const View still = renderer->view();
    return [renderer, still, &scene, &settings, &comparison, &composition, every](int k) {
      const int frame = k * every;
      const auto index = static_cast<std::size_t>(frame);
      std::vector<Image> pictures;
      for (const Run& run : comparison.runs) {
        renderer->look(view_at(still, scene, settings, comparison, run, index));
        pictures.push_back(panel_picture(*renderer, scene, settings, comparison, run, index));
      }
      return composition.frame(frame, pictures);
    };
  };
}

/// The key of the film's overlays.
std::vector<KeyEntry> key_of(const VideoSettings& settings, const Comparison& comparison) {
  const ErrorScale scale = error_scale(comparison);
  return key_of(settings.overlays, scale.lower, scale.upper);
}

/// A file that ffmpeg writes: beside, then renamed.
class FilmFile {
 public:
  FilmFile(const fs::path& file, const fs::path& program, std::vector<std::string> arguments)
      : program_(program), partial_(file) {
    arguments.push_back("file:" + partial_.path().string());
    ffmpeg_ = std::make_unique<Ffmpeg>(program, arguments, partial_.path());
  }

  void write(const Image& frame) {
    ffmpeg_->write(frame.rgb);
    ++frames_;
  }

  /// Waits until the file is complete and looks at it; returns its size. Throws Error.
  std::uintmax_t complete() {
    ffmpeg_->finish();
    require_whole_film(program_, partial_.path(), frames_);
    return fs::file_size(partial_.path());
  }
  void publish() { partial_.publish(); }

 private:
  fs::path program_;
  PartialFile partial_;
  std::unique_ptr<Ffmpeg> ffmpeg_;  // ended before its file is removed
  int frames_ = 0;
};

struct LoopAttempt {
  int width;
  int every;   ///< of the video's frames
  int colors;  ///< in the palette
};

void make_loop(const Scene& scene, const VideoSettings& settings, const Comparison& comparison,
               const fs::path& program) {
  constexpr std::uintmax_t limit = 2'000'000;
  // Each smaller than the one before; the first that is small enough is taken.
  for (const LoopAttempt attempt :
       {LoopAttempt{800, 2, 128}, LoopAttempt{800, 3, 96}, LoopAttempt{640, 3, 64}, LoopAttempt{480, 3, 48},
        LoopAttempt{400, 6, 32}}) {
    const int height =
        static_cast<int>(std::lround(0.5 * attempt.width * settings.height / settings.width)) * 2;
    const Composition composition(comparison, film_title(scene, settings.title), attempt.width, height,
                                  key_of(settings, comparison));
    const int count = (static_cast<int>(comparison.times.size()) - 1) / attempt.every + 1;
    const double rate = settings.frame_rate / attempt.every;
    std::vector<std::string> arguments = raw_frames_input(attempt.width, height, rate);
    const std::string filter = fmt::format(
        "split[a][b];[a]palettegen=max_colors={}:stats_mode=full[p];[b][p]paletteuse=dither=none:diff_mode="
        "rectangle",
        attempt.colors);
    // -loop 0: for ever. The last frame stays for a second before it starts again.
    for (const std::string& word :
         {std::string("-filter_complex"), filter, std::string("-loop"), std::string("0"),
          std::string("-final_delay"), std::string("100"), std::string("-fflags"), std::string("+bitexact"),
          std::string("-f"), std::string("gif")}) {
      arguments.push_back(word);
    }
    FilmFile film(*settings.loop, program, arguments);
    paint_in_order(count, settings.threads, painters(scene, settings, comparison, composition, attempt.every),
                   [&](int k, const Image& frame) {
                     film.write(frame);
                     if (settings.progress) settings.progress("loop", static_cast<double>(k + 1) / count);
                   });
    if (film.complete() <= limit) {
      film.publish();
      return;
    }
  }
  throw Error(fmt::format("{}: the loop cannot be made smaller than 2 MB: shorten it with --duration",
                          settings.loop->string()));
}

/// The frame nearest to the time asked for; without one, well into the film.
int poster_frame(const Comparison& comparison, const std::optional<double>& time) {
  const int last = static_cast<int>(comparison.times.size()) - 1;
  const double frame = 0.6 * last;
  if (!time) return static_cast<int>(std::lround(frame));
  const auto distance = [&](double t) { return std::abs(t - *time); };
  const auto nearest = std::ranges::min_element(comparison.times, {}, distance);
  return static_cast<int>(nearest - comparison.times.begin());
}

bool is_frame_name(const std::string& name) {
  return name.starts_with("frame_") && name.ends_with(".png") &&
         name.find_first_not_of("0123456789", 6) == name.size() - 4;
}

void refuse_other_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (is_frame_name(name)) continue;
    throw Error(fmt::format("{}: holds {}, which is no frame: name another folder for the frames",
                            folder.string(), name));
  }
}

/// Throws Error where something that is asked for cannot be made: long work comes before it would be.
void check_outputs(const VideoSettings& settings, bool has_container, bool has_ffmpeg) {
  check_film_size(settings.width, settings.height);
  if ((settings.overlays.ghost || settings.overlays.error) && !settings.comparison.has_reference) {
    throw Error("the overlays ghost and error show the reference, and there is none");
  }
  for (const auto& file : {settings.poster, settings.loop}) {
    if (file) require_folder_of(*file);
  }
  if (!settings.frames) {
    if (!has_container) {
      throw Error(
          fmt::format("{}: a film's name ends in .mp4, .webm, .gif or .apng, or in .png for a folder "
                      "of numbered pictures",
                      settings.output.string()));
    }
    require_folder_of(settings.output);
  }
  if (settings.loop && !has_ffmpeg) {
    throw Error("a loop needs ffmpeg, which is not in PATH: on Debian, apt-get install ffmpeg");
  }
}

}  // namespace

FrameFolder::FrameFolder(const fs::path& folder)
    : folder_(folder.has_filename() ? folder : folder.parent_path()) {
  std::error_code ignored;
  if (fs::exists(folder_, ignored)) {
    if (!fs::is_directory(folder_, ignored)) {
      throw Error(fmt::format("{}: is not a folder: name another for the frames", folder_.string()));
    }
    refuse_other_files(folder_);
  } else {
    require_folder_of(folder_);
  }
  partial_ = std::make_unique<PartialFile>(folder_, PartialFile::Kind::folder);
}

fs::path FrameFolder::next() {
  return partial_->path() / fmt::format("frame_{:04d}.png", count_++);
}

void FrameFolder::finish() {
  std::error_code failure;
  if (fs::exists(folder_, failure)) {
    // Once more: much time may have passed.
    refuse_other_files(folder_);
    fs::remove_all(folder_, failure);
  }
  partial_->publish();
}

VideoReport make_video(const Scene& scene, const VideoSettings& settings) {
  check_outputs(settings, container_of(settings.output).has_value(), find_ffmpeg().has_value());
  return make_video(scene, settings, simulate_comparison(scene, settings.comparison, [&](double share) {
                      if (settings.progress) settings.progress("simulating", share);
                    }));
}

VideoReport make_video(const Scene& scene, const VideoSettings& settings, Comparison simulated) {
  const std::optional<Container> container = container_of(settings.output);
  const std::optional<fs::path> program = find_ffmpeg();
  check_outputs(settings, container.has_value(), program.has_value());

  VideoReport report;
  report.is_film = program && !settings.frames;
  report.written = settings.output;
  std::unique_ptr<FrameFolder> folder;
  if (!report.is_film) {
    fs::path without_extension = settings.output;
    without_extension.replace_extension();
    report.written = settings.frames.value_or(without_extension.string() + "_frames");
    folder = std::make_unique<FrameFolder>(report.written);
    std::vector<std::string> arguments{"-framerate", fmt::format("{}", settings.frame_rate), "-i",
                                       (report.written / "frame_%04d.png").string()};
    for (const std::string& word : film_output(container.value_or(Container::mp4))) arguments.push_back(word);
    arguments.push_back(settings.output.string());
    report.film_command = command_line(arguments);
  }

  report.comparison = std::move(simulated);
  const Comparison& comparison = report.comparison;
  const Composition composition(comparison, film_title(scene, settings.title), settings.width,
                                settings.height, key_of(settings, comparison));

  std::unique_ptr<FilmFile> film;
  if (report.is_film) {
    std::vector<std::string> arguments =
        raw_frames_input(settings.width, settings.height, settings.frame_rate);
    for (const std::string& word : film_output(*container)) arguments.push_back(word);
    film = std::make_unique<FilmFile>(settings.output, *program, arguments);
  }
  const int count = static_cast<int>(comparison.times.size());
  const int held = static_cast<int>(std::lround(settings.hold * settings.frame_rate));
  std::string poster;
  paint_in_order(count, settings.threads, painters(scene, settings, comparison, composition, 1),
                 [&](int k, const Image& frame) {
                   for (int copies = k + 1 == count ? 1 + held : 1; copies > 0; --copies) {
                     if (film) film->write(frame);
                     if (folder) write_png(frame, folder->next());
                   }
                   if (settings.poster && k == poster_frame(comparison, settings.poster_time))
                     poster = to_png(frame);
                   if (settings.progress) settings.progress("drawing", static_cast<double>(k + 1) / count);
                 });
  if (settings.loop) make_loop(scene, settings, comparison, *program);
  if (film) {
    film->complete();
    film->publish();
  }
  if (folder) folder->finish();
  if (settings.poster) write_file(*settings.poster, poster);
  return report;
}

}  // namespace substep
