#include "render/video/ffmpeg.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string_view>
#include <system_error>

#include "sim/error.h"
#include "sim/execution/child_process.h"

namespace substep {

namespace fs = std::filesystem;

std::optional<fs::path> find_ffmpeg() {
  const char* const variable = std::getenv("PATH");
  std::string_view folders = variable != nullptr ? variable : "";
  while (!folders.empty()) {
    const std::size_t length = std::min(folders.find(':'), folders.size());
    const fs::path program = fs::path(folders.substr(0, length)) / "ffmpeg";
    if (length > 0 && ::access(program.c_str(), X_OK) == 0 && fs::is_regular_file(program)) return program;
    folders.remove_prefix(std::min(folders.size(), length + 1));
  }
  return std::nullopt;
}

std::vector<std::string> raw_frames_input(int width, int height, double frame_rate) {
  return {"-f",         "rawvideo",
          "-pix_fmt",   "rgb24",
          "-s",         fmt::format("{}x{}", width, height),
          "-framerate", fmt::format("{}", frame_rate),
          "-i",         "pipe:0"};
}

std::optional<Container> container_of(const fs::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".mp4") return Container::mp4;
  if (extension == ".webm") return Container::webm;
  if (extension == ".gif") return Container::gif;
  if (extension == ".apng") return Container::apng;
  return std::nullopt;
}

std::vector<std::string> film_output(Container container) {
  // The colour conversion that gives the same bytes whatever instructions the machine has, to the matrix that
  // players assume of a film of this size.
  const std::string to_video =
      "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+bitexact+full_chroma_int,format=yuv420p";
  std::vector<std::string> words;
  const auto add = [&words](std::initializer_list<std::string> more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  add({"-an"});
  if (container == Container::mp4 || container == Container::webm) {
    add({"-vf", to_video, "-sws_flags", "+accurate_rnd+bitexact+full_chroma_int"});
  }
  switch (container) {
    case Container::mp4:
      add({"-c:v", "libx264", "-preset", "veryfast", "-crf", "20"});
      break;
    case Container::webm:
      add({"-c:v", "libvpx-vp9", "-deadline", "realtime", "-cpu-used", "8", "-row-mt", "1", "-crf", "33",
           "-b:v", "0"});
      break;
    case Container::gif:
      // A palette a frame: one for the whole film would keep all its frames in memory.
      add({"-filter_complex",
           "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=dither=none:new=1", "-loop",
           "0"});
      break;
    case Container::apng:
      add({"-c:v", "apng", "-pred", "none", "-plays", "0"});
      break;
  }
  if (container == Container::mp4 || container == Container::webm) {
    add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"});
  }
  // Without this message the file does not tell how many threads wrote it.
  if (container == Container::mp4) add({"-bsf:v", "filter_units=remove_types=6"});
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  if (container == Container::mp4) add({"-movflags", "+faststart"});
  add({"-f", container == Container::mp4    ? "mp4"
             : container == Container::webm ? "webm"
             : container == Container::gif  ? "gif"
                                            : "apng"});
  return words;
}

std::string command_line(const std::vector<std::string>& arguments) {
  std::string line = "ffmpeg";
  for (const std::string& argument : arguments) {
    const bool plain =
        !argument.empty() &&
        argument.find_first_not_of(
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./%") == std::string::npos;
    if (plain) {
      line += " " + argument;
      continue;
    }
    line += " '";
    for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += "'";
  }
  return line;
}

struct Ffmpeg::Implementation {
  TemporaryFile messages;
  std::optional<ChildProcess> process;
  int frames_in = -1;   ///< the pipe's end that frames are written to
  int frames_out = -1;  ///< and ffmpeg's
  struct sigaction previous {};

  Implementation() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &previous);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    close(frames_in);
    close(frames_out);
    process.reset();
    ::sigaction(SIGPIPE, &previous, nullptr);
  }

  static void close(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }

  void start(const std::vector<std::string>& words) {
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category());
    frames_out = ends[0];
    frames_in = ends[1];
    process.emplace(words, ChildProcess::Streams{
                               .in = frames_out, .out = ChildProcess::nowhere, .err = messages.descriptor()});
    close(frames_out);
  }

  /// The last line that ffmpeg wrote; the lines before it are its context.
  std::string last_message() const {
    std::string text = messages.content();
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    const std::size_t start = text.find_last_of("\r\n");
    return start == std::string::npos ? text : text.substr(start + 1);
  }
};

Ffmpeg::Ffmpeg(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{program.string(), "-hide_banner", "-loglevel", "error", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  try {
    implementation_ = std::make_unique<Implementation>();
    implementation_->start(words);
  } catch (const std::system_error& error) {
    throw Error(fmt::format("{}: cannot be started: {}", program.string(), error.code().message()));
  }
}

Ffmpeg::~Ffmpeg() = default;

void Ffmpeg::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(implementation_->frames_in, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    } else if (errno == EPIPE) {
      finish();
      throw Error("ffmpeg ended before it had all frames");
    } else if (errno != EINTR) {
      throw Error(fmt::format("ffmpeg cannot be written to: {}", std::strerror(errno)));
    }
  }
}

void Ffmpeg::finish() {
  Implementation::close(implementation_->frames_in);
  if (implementation_->process->succeeds()) return;
  const std::string message = implementation_->last_message();
  throw Error(fmt::format("ffmpeg failed: {}", message.empty() ? "it gave no reason" : message));
}

}  // namespace substep
