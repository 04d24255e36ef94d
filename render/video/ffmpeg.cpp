#include "render/video/ffmpeg.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "sim/error.h"

namespace substep::render {

namespace fs = std::filesystem;

namespace {

/// Names of `Container`: file extensions, and ffmpeg's muxers.
constexpr std::array<std::string_view, 4> containers{"mp4", "webm", "gif", "apng"};

/// Returns the last line of a message, after its context.
std::string last_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  const std::size_t start = text.find_last_of("\r\n");
  return start == std::string::npos ? text : text.substr(start + 1);
}

}  // namespace

std::optional<fs::path> find_ffmpeg() {
  const char* const variable = std::getenv("PATH");
  std::istringstream folders(variable != nullptr ? variable : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder) / "ffmpeg";
    const bool is_there = ::access(program.c_str(), X_OK) == 0 && fs::is_regular_file(program);
    if (is_there && !folder.empty()) return program;
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
  const auto found = std::ranges::find_if(
      containers, [&](std::string_view name) { return extension == fmt::format(".{}", name); });
  if (found == containers.end()) return std::nullopt;
  return static_cast<Container>(found - containers.begin());
}

std::vector<std::string> film_output(Container container) {
  std::vector<std::string> words{"-an"};
  const auto add = [&words](std::initializer_list<std::string> more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  const bool is_video = container == Container::mp4 || container == Container::webm;
  if (is_video) {
    // Convert colours with the same bytes on every machine, to the matrix that players assume.
    add({"-vf",
         "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+bitexact+full_chroma_int,format="
         "yuv420p",
         "-sws_flags", "+accurate_rnd+bitexact+full_chroma_int"});
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
      // Use a palette for each frame: one for the film would keep all frames in memory.
      add({"-filter_complex",
           "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=dither=none:new=1", "-loop",
           "0"});
      break;
    case Container::apng:
      add({"-c:v", "apng", "-pred", "none", "-plays", "0"});
      break;
  }
  if (is_video) {
    add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"});
  }
  // Remove the message that tells how many threads wrote the file.
  if (container == Container::mp4) add({"-bsf:v", "filter_units=remove_types=6"});
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  if (container == Container::mp4) add({"-movflags", "+faststart"});
  add({"-f", std::string(containers.at(static_cast<std::size_t>(container)))});
  return words;
}

std::string command_line(const std::vector<std::string>& arguments) {
  constexpr const char* plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./%";
  std::string line = "ffmpeg";
  for (const std::string& argument : arguments) {
    if (!argument.empty() && argument.find_first_not_of(plain) == std::string::npos) {
      line += " " + argument;
      continue;
    }
    line += " '";
    for (const char c : argument) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += "'";
  }
  return line;
}

Ffmpeg::Ffmpeg(const fs::path& program, const std::vector<std::string>& arguments, fs::path output,
               std::chrono::milliseconds patience)
    : output_(std::move(output)), patience_(patience) {
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error("{}: cannot be started: {}", program.string(), std::strerror(errno));
  // Write without waiting, so that a stalled pipe times out.
  ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
  std::vector<std::string> words{program.string(), "-hide_banner", "-loglevel", "error", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  try {
    process_.emplace(
        std::move(words),
        ChildProcess::Streams{.in = ends[0], .out = answer_.descriptor(), .err = messages_.descriptor()});
  } catch (const std::system_error& error) {
    for (const int end : ends) ::close(end);
    throw Error("{}: cannot be started: {}", program.string(), error.code().message());
  }
  ::close(ends[0]);
  pipe_ = ends[1];
  writer_.emplace(process_->id());
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  ::sigaction(SIGPIPE, &ignore, &previous_);
}

Ffmpeg::~Ffmpeg() {
  close_pipe();
  process_.reset();
  writer_.reset();
  ::sigaction(SIGPIPE, &previous_, nullptr);
}

void Ffmpeg::close_pipe() {
  if (pipe_ >= 0) ::close(std::exchange(pipe_, -1));
}

/// Throws Error if neither the pipe nor the output file has progressed for `patience_`.
void Ffmpeg::require_progress() {
  std::error_code none;
  const std::uintmax_t now = output_.empty() ? 0 : fs::file_size(output_, none);
  if (!none && now != size_) {
    size_ = now;
    last_progress_ = Clock::now();
  }
  if (Clock::now() - last_progress_ < patience_) return;
  throw Error("ffmpeg has done nothing for {:g} s: it was ended",
              std::chrono::duration<double>(patience_).count());
}

void Ffmpeg::write(std::span<const std::uint8_t> bytes) {
  last_progress_ = Clock::now();
  while (!bytes.empty()) {
    const ssize_t written = ::write(pipe_, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      last_progress_ = Clock::now();
    } else if (errno == EPIPE) {
      finish();
      throw Error("ffmpeg ended before it had all frames");
    } else if (errno == EAGAIN) {
      pollfd room{pipe_, POLLOUT, 0};
      ::poll(&room, 1, 100);
      require_progress();
    } else if (errno != EINTR) {
      throw Error("ffmpeg cannot be written to: {}", std::strerror(errno));
    }
  }
}

std::string Ffmpeg::finish() {
  close_pipe();
  last_progress_ = Clock::now();
  std::optional<bool> is_done;
  for (auto pause = std::chrono::milliseconds(1); !(is_done = process_->ended());) {
    require_progress();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(50));
  }
  writer_.reset();
  const std::string message = last_line(messages_.content());
  if (*is_done && message.empty()) return answer_.content();
  throw Error("ffmpeg failed: {}", message.empty() ? "it gave no reason" : message);
}

void require_whole_film(const fs::path& program, const fs::path& film, int frames) {
  // List one line for each packet, and comments.
  Ffmpeg reader(program,
                {"-i", "file:" + film.string(), "-map", "0:v:0", "-c", "copy", "-f", "framecrc", "pipe:1"});
  std::istringstream list(reader.finish());
  int found = 0;
  for (std::string line; std::getline(list, line);) found += line.starts_with('#') ? 0 : 1;
  if (found != frames) throw Error("ffmpeg failed: its film has {} frames of {}", found, frames);
}

}  // namespace substep::render
