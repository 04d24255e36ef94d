#include "render/video/ffmpeg.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "sim/error.h"
#include "sim/execution/child_process.h"
#include "sim/log/file_output.h"

namespace substep::render {

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

namespace {

/// The last line; the lines before it are its context.
std::string last_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  const std::size_t start = text.find_last_of("\r\n");
  return start == std::string::npos ? text : text.substr(start + 1);
}

}  // namespace

struct Ffmpeg::Implementation {
  using Clock = std::chrono::steady_clock;

  TemporaryFile messages;
  TemporaryFile answer;
  std::optional<ChildProcess> process;
  std::optional<PartialFileWriter> writer;  // of `process`, as long as it runs
  int pipe = -1;
  fs::path output;
  std::chrono::milliseconds patience{};
  std::uintmax_t size = 0;  // of `output` when it was looked at last
  Clock::time_point last_progress = Clock::now();
  struct sigaction previous {};

  Implementation() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &previous);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    close_pipe();
    process.reset();
    writer.reset();
    ::sigaction(SIGPIPE, &previous, nullptr);
  }

  void close_pipe() {
    if (pipe >= 0) ::close(pipe);
    pipe = -1;
  }

  /// Throws Error when nothing has happened for too long.
  void require_progress() {
    std::error_code none;
    const std::uintmax_t now = output.empty() ? 0 : fs::file_size(output, none);
    if (!none && now != size) {
      size = now;
      last_progress = Clock::now();
    }
    if (Clock::now() - last_progress < patience) return;
    throw Error(fmt::format("ffmpeg has done nothing for {:g} s: it was ended",
                            std::chrono::duration<double>(patience).count()));
  }
};

Ffmpeg::Ffmpeg(const fs::path& program, const std::vector<std::string>& arguments, fs::path output,
               std::chrono::milliseconds patience)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.output = std::move(output);
  self.patience = patience;
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(fmt::format("{}: cannot be started: {}", program.string(), std::strerror(errno)));
  }
  self.pipe = ends[1];
  // So that a pipe that is never emptied can be given up.
  ::fcntl(self.pipe, F_SETFL, O_NONBLOCK);
  std::vector<std::string> words{program.string(), "-hide_banner", "-loglevel", "error", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  try {
    self.process.emplace(std::move(words), ChildProcess::Streams{.in = ends[0],
                                                                 .out = self.answer.descriptor(),
                                                                 .err = self.messages.descriptor()});
  } catch (const std::system_error& error) {
    ::close(ends[0]);
    throw Error(fmt::format("{}: cannot be started: {}", program.string(), error.code().message()));
  }
  ::close(ends[0]);
  self.writer.emplace(self.process->id());
}

Ffmpeg::~Ffmpeg() = default;

void Ffmpeg::write(std::span<const std::uint8_t> bytes) {
  Implementation& self = *implementation_;
  self.last_progress = Implementation::Clock::now();
  while (!bytes.empty()) {
    const ssize_t written = ::write(self.pipe, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      self.last_progress = Implementation::Clock::now();
    } else if (errno == EPIPE) {
      finish();
      throw Error("ffmpeg ended before it had all frames");
    } else if (errno == EAGAIN) {
      pollfd room{self.pipe, POLLOUT, 0};
      ::poll(&room, 1, 100);
      self.require_progress();
    } else if (errno != EINTR) {
      throw Error(fmt::format("ffmpeg cannot be written to: {}", std::strerror(errno)));
    }
  }
}

std::string Ffmpeg::finish() {
  Implementation& self = *implementation_;
  self.close_pipe();
  self.last_progress = Implementation::Clock::now();
  std::optional<bool> is_done;
  for (auto pause = std::chrono::milliseconds(1); !(is_done = self.process->ended());) {
    self.require_progress();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(50));
  }
  self.writer.reset();
  const std::string message = last_line(self.messages.content());
  if (*is_done && message.empty()) return self.answer.content();
  throw Error(fmt::format("ffmpeg failed: {}", message.empty() ? "it gave no reason" : message));
}

void require_whole_film(const fs::path& program, const fs::path& film, int frames) {
  // One line a packet, and comments.
  Ffmpeg reader(program,
                {"-i", "file:" + film.string(), "-map", "0:v:0", "-c", "copy", "-f", "framecrc", "pipe:1"});
  const std::string list = reader.finish();
  int found = 0;
  for (std::size_t start = 0; start < list.size();
       start = std::min(list.find('\n', start), list.size()) + 1) {
    found += list[start] != '#';
  }
  if (found != frames) {
    throw Error(fmt::format("ffmpeg failed: its film has {} frames of {}", found, frames));
  }
}

}  // namespace substep::render
