#include "render/video/video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <system_error>
#include <utility>

#include "render/image.h"
#include "render/video/ffmpeg.h"
#include "render/video/film_painter.h"
#include "sim/error.h"
#include "sim/log/file_output.h"

namespace substep::render {
namespace {

namespace fs = std::filesystem;

/// A folder of numbered frames frame_0000.png …, whole or not at all: frames are written to a folder beside
/// it, which is then renamed. Replaces an earlier folder of such frames. Throws Error where the folder holds
/// other files.
class FrameFolder {
 public:
  explicit FrameFolder(const fs::path& folder)
      : folder_(folder.has_filename() ? folder : folder.parent_path()) {
    std::error_code ignored;
    if (fs::exists(folder_, ignored)) {
      if (!fs::is_directory(folder_, ignored))
        throw Error("{}: is not a folder: name another for the frames", folder_.string());
      refuse_other_files();
    } else {
      require_folder_of(folder_);
    }
    partial_ = std::make_unique<PartialFile>(folder_, PartialFile::Kind::folder);
  }

  void write(const Image& frame) {
    write_png(frame, partial_->path() / fmt::format("frame_{:04d}.png", count_++));
  }

  void publish() {
    std::error_code failure;
    if (fs::exists(folder_, failure)) {
      // Check again: much time may have passed.
      refuse_other_files();
      fs::remove_all(folder_, failure);
    }
    partial_->publish();
  }

 private:
  void refuse_other_files() const {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      const bool is_frame = name.starts_with("frame_") && name.ends_with(".png") &&
                            name.find_first_not_of("0123456789", 6) == name.size() - 4;
      if (is_frame) continue;
      throw Error("{}: holds {}, which is no frame: name another folder for the frames", folder_.string(),
                  name);
    }
  }

  fs::path folder_;
  std::unique_ptr<PartialFile> partial_;
  int count_ = 0;
};

/// A file that ffmpeg writes, whole or not at all.
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

  /// Waits until the file is complete, checks it and returns its size. Throws Error.
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

/// Largest frame rate of a GIF file: its delays are hundredths of a second, and players ignore those of one.
constexpr double most_in_gif = 50;

std::vector<std::string> joined(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Writes a loop of at most 2 MB: the first of several attempts of falling size that fits. Throws Error
/// where none does.
void make_loop(const Film& film, const fs::path& program) {
  const VideoSettings& settings = film.settings;
  struct LoopAttempt {
    int width;
    int every;   ///< 2: every second frame of the film
    int colors;  ///< in the palette
  };
  for (const auto& [width, fewest, colors] :
       {LoopAttempt{800, 2, 128}, LoopAttempt{800, 3, 96}, LoopAttempt{640, 3, 64}, LoopAttempt{480, 3, 48},
        LoopAttempt{400, 6, 32}}) {
    const int every = std::max(fewest, static_cast<int>(std::ceil(settings.frame_rate / most_in_gif)));
    const int height = static_cast<int>(std::lround(0.5 * width * settings.height / settings.width)) * 2;
    const int count = (static_cast<int>(film.comparison.times.size()) - 1) / every + 1;
    const std::string filter = fmt::format(
        "split[a][b];[a]palettegen=max_colors={}:stats_mode=full[p];[b][p]paletteuse=dither=none:diff_mode="
        "rectangle",
        colors);
    // Loop for ever (-loop 0), with the last frame for a second (-final_delay 100).
    FilmFile file(*settings.loop, program,
                  joined(raw_frames_input(width, height, settings.frame_rate / every),
                         {"-filter_complex", filter, "-loop", "0", "-final_delay", "100", "-fflags",
                          "+bitexact", "-f", "gif"}));
    paint_frames(film, width, height, every, [&](int k, const Image& frame) {
      file.write(frame);
      settings.progress("loop", static_cast<double>(k + 1) / count);
    });
    if (file.complete() <= 2'000'000) return file.publish();
  }
  throw Error("{}: the loop cannot be made smaller than 2 MB: shorten it with --duration",
              settings.loop->string());
}

/// Throws Error where an output cannot be made, before the long work.
void check_outputs(const VideoSettings& settings, const std::optional<Container>& container,
                   bool has_ffmpeg) {
  check_film_size(settings.width, settings.height);
  const bool shows_error = settings.overlays.tint == Overlays::Tint::error ||
                           std::ranges::find(settings.strips, Strip::error) != settings.strips.end();
  if ((settings.overlays.ghost || shows_error || settings.freezes) && !settings.comparison.has_reference)
    throw Error(
        "the overlay ghost, --freeze, and error in --overlay or --strip show the reference, and there is "
        "none");
  for (const auto& file : {settings.poster, settings.loop}) {
    if (file) require_folder_of(*file);
  }
  if (!settings.frames) {
    if (!container) {
      throw Error(
          "{}: a film's name ends in .mp4, .webm, .gif or .apng, or in .png for a folder of "
          "numbered pictures",
          settings.output.string());
    }
    require_folder_of(settings.output);
  }
  if (container == Container::gif && settings.frame_rate > most_in_gif) {
    throw Error("--fps {:g}: a .gif has at most {:g} frames a second: lower it, or give .mp4, .webm or .apng",
                settings.frame_rate, most_in_gif);
  }
  if ((settings.loop || !settings.frames) && !has_ffmpeg) {
    throw Error(
        "{}: a film needs ffmpeg, which is not in PATH: on Debian, apt-get install ffmpeg; a "
        "folder of numbered pictures needs none (--frames)",
        settings.loop.value_or(settings.output).string());
  }
}

/// Returns the settings with the quantities that the overlays and strips show.
ComparisonSettings with_quantities(const Scene& scene, const VideoSettings& settings) {
  ComparisonSettings comparison = settings.comparison;
  QuantityChoice& quantities = comparison.quantities;
  quantities.gap = settings.overlays.joints;
  for (const Strip strip : settings.strips) quantities.add(strip, scene);
  quantities.speeds = settings.overlays.tint == Overlays::Tint::speed;
  quantities.depths = settings.overlays.tint == Overlays::Tint::penetration;
  quantities.contacts = settings.overlays.contacts;
  return comparison;
}

}  // namespace

VideoReport make_video(const Scene& scene, const VideoSettings& settings,
                       std::optional<Comparison> simulated) {
  const std::optional<Container> container = container_of(settings.output);
  const std::optional<fs::path> program = find_ffmpeg();
  check_outputs(settings, container, program.has_value());
  if (!simulated) {
    simulated = simulate_comparison(scene, with_quantities(scene, settings),
                                    [&](double fraction) { settings.progress("simulating", fraction); });
  }
  VideoReport report;
  report.comparison = std::move(*simulated);
  const Comparison& comparison = report.comparison;
  const Film film = film_of(scene, settings, comparison);

  std::unique_ptr<FrameFolder> folder;
  std::unique_ptr<FilmFile> file;
  const std::vector<std::string> output = film_output(container.value_or(Container::mp4));
  if (settings.frames) {
    folder = std::make_unique<FrameFolder>(*settings.frames);
    const std::string pictures = (*settings.frames / "frame_%04d.png").string();
    report.film_command = command_line(
        joined(joined({"-framerate", fmt::format("{}", settings.frame_rate), "-i", pictures}, output),
               {settings.output.string()}));
  } else {
    file = std::make_unique<FilmFile>(
        settings.output, *program,
        joined(raw_frames_input(settings.width, settings.height, settings.frame_rate), output));
  }
  const int count = static_cast<int>(comparison.times.size());
  const int held = static_cast<int>(std::lround(settings.hold * settings.frame_rate));
  const auto frozen = static_cast<int>(std::lround(1.5 * settings.frame_rate));
  const std::optional<std::size_t> freeze = film.freeze();
  std::string poster;
  paint_frames(film, settings.width, settings.height, 1, [&](int k, const Image& frame) {
    const bool freezes = freeze && k == static_cast<int>(*freeze);
    const int more = (k + 1 == count ? held : 0) + (freezes ? frozen : 0);
    for (int copies = 1 + more; copies > 0; --copies) {
      if (file) file->write(frame);
      if (folder) folder->write(frame);
    }
    if (settings.poster && k == std::lround(0.6 * (count - 1))) poster = to_png(frame);
    settings.progress("drawing", static_cast<double>(k + 1) / count);
  });
  if (settings.loop) make_loop(film, *program);
  if (file) {
    file->complete();
    file->publish();
  }
  if (folder) folder->publish();
  if (settings.poster) write_file(*settings.poster, poster);
  return report;
}

}  // namespace substep::render
