#include "render/video/video.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "render/image.h"
#include "render/video/ffmpeg.h"
#include "render/video/film_painter.h"
#include "render/video/frame_folder.h"
#include "sim/error.h"
#include "sim/log/file_output.h"
#include "sim/measure/expectations.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

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
