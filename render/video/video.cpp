#include "render/video/video.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <map>
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
#include "sim/measure/expectations.h"

namespace substep::render {
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
  // A second of film is as many frames as its rate says.
  const double seconds = static_cast<double>(k) / settings.frame_rate;
  return moved(view, settings.camera, way, std::min(seconds, static_cast<double>(comparison.times.size())),
               middle_of(scene));
}

/// What stays the same for all frames of a film.
struct Film {
  const Scene& scene;
  const VideoSettings& settings;
  const Comparison& comparison;
  OverlayScales scales = scales_of(scene, comparison, settings.overlays);
  std::vector<std::optional<Departure>> departures{};  ///< of the runs, where the film freezes

  std::size_t second() const {  ///< in frames
    return static_cast<std::size_t>(std::max(1L, std::lround(settings.frame_rate)));
  }
  /// The first at which a run has left the reference.
  std::optional<std::size_t> freeze() const {
    std::optional<std::size_t> first;
    for (const std::optional<Departure>& departure : departures) {
      if (departure) first = std::min(first.value_or(departure->frame), departure->frame);
    }
    return first;
  }
};

Film film_of(const Scene& scene, const VideoSettings& settings, const Comparison& comparison) {
  Film film{scene, settings, comparison};
  for (const Run& run : comparison.runs) {
    film.departures.push_back(settings.freezes ? departure_of(scene, comparison, run) : std::nullopt);
  }
  return film;
}

/// Draws one panel's pictures, by a renderer that other panels share. A picture serves all frames in which
/// nothing moves.
class PanelPainter {
 public:
  PanelPainter(const Film& film, std::size_t index, std::shared_ptr<Renderer> renderer)
      : film_(film), index_(index), renderer_(std::move(renderer)), still_(renderer_->view()) {
    shown_frames_.push_back(0);
    std::vector<Coordinates> last = poses_at(film.scene, run(), 0);
    for (std::size_t k = 1; k < film.comparison.times.size(); ++k) {
      std::vector<Coordinates> poses = poses_at(film.scene, run(), k);
      renderer_->look(view(k));
      constexpr double unseen = 0.02;  // pixels
      const bool moves = view(k) != view(shown_frames_.back()) || renderer_->moves_by(unseen, last, poses);
      shown_frames_.push_back(moves ? k : shown_frames_.back());
      if (moves) last = std::move(poses);
    }
    renderer_->look(still_);
  }

  /// Returns the picture at film frame k, with its overlays.
  Image picture(std::size_t k) {
    const VideoSettings& settings = film_.settings;
    const Comparison& comparison = film_.comparison;
    const std::vector<Coordinates> poses = poses_at(film_.scene, run(), shown_frames_[k]);
    renderer_->look(view(k));
    if (drawn_ != shown_frames_[k]) drawn_picture_ = renderer_->draw(poses);
    drawn_ = shown_frames_[k];
    const std::optional<Departure>& departure = film_.departures[index_];
    const bool is_ringed = departure && k >= departure->frame && k < departure->frame + film_.second();
    if ((!settings.overlays.any() && !is_ringed) || run().is_reference()) return drawn_picture_;
    OverlayFrame frame{film_.scene, renderer_->view(), run(), film_.scales};
    frame.k = k;
    frame.trail = film_.second();
    Image bodies;
    Image reference_bodies;
    if (settings.overlays.tint != Overlays::Tint::none) {
      bodies = renderer_->draw_bodies(poses);
      frame.bodies = &bodies;
    }
    if (comparison.reference && k < comparison.reference->known) {
      frame.reference = &*comparison.reference;
      if (settings.overlays.ghost) {
        reference_bodies = renderer_->draw_bodies(comparison.reference->poses[k]);
        frame.reference_bodies = &reference_bodies;
      }
    }
    Image picture = drawn_picture_;
    draw_overlays(picture, settings.overlays, frame);
    if (is_ringed) draw_departure(picture, *departure, frame);
    return picture;
  }

 private:
  const Run& run() const { return film_.comparison.runs[index_]; }
  View view(std::size_t k) const {
    return view_at(still_, film_.scene, film_.settings, film_.comparison, run(), k);
  }

  const Film& film_;
  std::size_t index_;
  std::shared_ptr<Renderer> renderer_;
  View still_;
  std::vector<std::size_t> shown_frames_;  ///< of each frame, the one whose poses it shows
  std::optional<std::size_t> drawn_;       ///< the frame whose poses were drawn last
  Image drawn_picture_;
};

/// Paints film frames of this size; `every` of the comparison's frames is painted, the others are left out.
std::function<Painter()> painters(const Film& film, const Composition& composition, int every) {
  return [&film, &composition, every]() -> Painter {
    // Panels of a row are as wide as one another; another row's may be wider.
    std::map<int, std::shared_ptr<Renderer>> renderers;
    auto panels = std::make_shared<std::vector<PanelPainter>>();
    for (std::size_t run = 0; run < film.comparison.runs.size(); ++run) {
      RenderSettings pictures;
      pictures.width = composition.picture_width(run);
      pictures.height = composition.picture_height();
      pictures.steps_back = !film.settings.camera.named;
      std::shared_ptr<Renderer>& renderer = renderers[pictures.width];
      if (!renderer) {
        renderer = std::make_shared<Renderer>(seen_by(film.settings.camera, film.scene), pictures,
                                              seen_frames(film.scene, film.comparison));
      }
      panels->emplace_back(film, run, renderer);
    }
    return [panels, &composition, every](int k) {
      const int frame = k * every;
      std::vector<Image> pictures;
      for (PanelPainter& panel : *panels) pictures.push_back(panel.picture(static_cast<std::size_t>(frame)));
      return composition.frame(frame, pictures);
    };
  };
}

Composition composition_of(const Film& film, int width, int height) {
  return {film.comparison,
          film_title(film.scene, film.settings.title),
          width,
          height,
          key_of(film.settings.overlays, film.scales, film.freeze().has_value()),
          film.settings.strips};
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

void make_loop(const Film& film_frames, const fs::path& program) {
  const VideoSettings& settings = film_frames.settings;
  const Comparison& comparison = film_frames.comparison;
  constexpr std::uintmax_t limit = 2'000'000;
  // Each smaller than the one before; the first that is small enough is taken.
  for (const LoopAttempt attempt :
       {LoopAttempt{800, 2, 128}, LoopAttempt{800, 3, 96}, LoopAttempt{640, 3, 64}, LoopAttempt{480, 3, 48},
        LoopAttempt{400, 6, 32}}) {
    const int height =
        static_cast<int>(std::lround(0.5 * attempt.width * settings.height / settings.width)) * 2;
    const Composition composition = composition_of(film_frames, attempt.width, height);
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
    paint_in_order(count, settings.threads, painters(film_frames, composition, attempt.every),
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
  const bool shows_error = settings.overlays.tint == Overlays::Tint::error;
  if ((settings.overlays.ghost || shows_error || settings.freezes) && !settings.comparison.has_reference) {
    throw Error("the overlays ghost and error, and --freeze, show the reference, and there is none");
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
  if ((settings.loop || !settings.frames) && !has_ffmpeg) {
    throw Error(fmt::format(
        "{}: a film needs ffmpeg, which is not in PATH: on Debian, apt-get install ffmpeg; a folder of "
        "numbered pictures needs none (--frames)",
        settings.loop.value_or(settings.output).string()));
  }
}

/// Of this process, or of those that it waited for.
double cpu_seconds(int who) {
  rusage usage{};
  getrusage(who, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// With what the overlays and strips show.
ComparisonSettings with_readings(const Scene& scene, const VideoSettings& settings) {
  ComparisonSettings comparison = settings.comparison;
  ReadingChoice& readings = comparison.readings;
  const auto has = [&](Strip strip) {
    return std::ranges::find(settings.strips, strip) != settings.strips.end();
  };
  readings.gap = has(Strip::gap) || settings.overlays.joints;
  readings.deepest = has(Strip::depth);
  if (has(Strip::expected)) {
    readings.expected = expectation_of_poses(scene);
    if (readings.expected == nullptr)
      throw Error("--strip expected: the scene expects nothing that follows from poses");
  }
  readings.energy = has(Strip::energy);
  readings.speeds = settings.overlays.tint == Overlays::Tint::velocity;
  readings.depths = settings.overlays.tint == Overlays::Tint::penetration;
  readings.contacts = settings.overlays.contacts;
  return comparison;
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
  const double start = cpu_seconds(RUSAGE_SELF);
  Comparison simulated = simulate_comparison(scene, with_readings(scene, settings), [&](double share) {
    if (settings.progress) settings.progress("simulating", share);
  });
  const double simulating = cpu_seconds(RUSAGE_SELF) - start;
  VideoReport report = make_video(scene, settings, std::move(simulated));
  report.cpu.simulating = simulating;
  return report;
}

VideoReport make_video(const Scene& scene, const VideoSettings& settings, Comparison simulated) {
  const std::optional<Container> container = container_of(settings.output);
  const std::optional<fs::path> program = find_ffmpeg();
  check_outputs(settings, container.has_value(), program.has_value());

  VideoReport report;
  report.written = settings.frames.value_or(settings.output);
  std::unique_ptr<FrameFolder> folder;
  if (settings.frames) {
    folder = std::make_unique<FrameFolder>(report.written);
    std::vector<std::string> arguments{"-framerate", fmt::format("{}", settings.frame_rate), "-i",
                                       (report.written / "frame_%04d.png").string()};
    for (const std::string& word : film_output(container.value_or(Container::mp4))) arguments.push_back(word);
    arguments.push_back(settings.output.string());
    report.film_command = command_line(arguments);
  }

  report.comparison = std::move(simulated);
  const double start = cpu_seconds(RUSAGE_SELF);
  const double ffmpeg_start = cpu_seconds(RUSAGE_CHILDREN);
  const Comparison& comparison = report.comparison;
  const Film shown = film_of(scene, settings, comparison);
  const Composition composition = composition_of(shown, settings.width, settings.height);

  std::unique_ptr<FilmFile> film;
  if (!settings.frames) {
    std::vector<std::string> arguments =
        raw_frames_input(settings.width, settings.height, settings.frame_rate);
    for (const std::string& word : film_output(*container)) arguments.push_back(word);
    film = std::make_unique<FilmFile>(settings.output, *program, arguments);
  }
  const int count = static_cast<int>(comparison.times.size());
  const int held = static_cast<int>(std::lround(settings.hold * settings.frame_rate));
  std::string poster;
  const std::optional<std::size_t> freeze = shown.freeze();
  const auto frozen = static_cast<int>(std::lround(1.5 * settings.frame_rate));
  paint_in_order(count, settings.threads, painters(shown, composition, 1), [&](int k, const Image& frame) {
    const bool freezes = freeze && k == static_cast<int>(*freeze);
    const int more = (k + 1 == count ? held : 0) + (freezes ? frozen : 0);
    for (int copies = 1 + more; copies > 0; --copies) {
      if (film) film->write(frame);
      if (folder) write_png(frame, folder->next());
    }
    if (settings.poster && k == poster_frame(comparison, settings.poster_time)) poster = to_png(frame);
    if (settings.progress) settings.progress("drawing", static_cast<double>(k + 1) / count);
  });
  if (settings.loop) make_loop(shown, *program);
  if (film) {
    film->complete();
    film->publish();
  }
  if (folder) folder->finish();
  if (settings.poster) write_file(*settings.poster, poster);
  report.cpu.drawing = cpu_seconds(RUSAGE_SELF) - start;
  report.cpu.encoding = cpu_seconds(RUSAGE_CHILDREN) - ffmpeg_start;
  return report;
}

}  // namespace substep::render
