#include "render/video/ffmpeg.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string_view>

#include "sim/error.h"

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
  pid_t process = -1;
  int pipe = -1;
  std::FILE* messages = nullptr;
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
    if (process > 0) {
      ::kill(process, SIGTERM);
      wait();
    }
    if (messages != nullptr) std::fclose(messages);
    ::sigaction(SIGPIPE, &previous, nullptr);
  }

  void close_pipe() {
    if (pipe >= 0) ::close(pipe);
    pipe = -1;
  }

  int wait() {
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    process = -1;
    return status;
  }

  /// The last line that ffmpeg wrote; the lines before it are its context.
  std::string last_message() const {
    std::string text;
    std::rewind(messages);
    std::array<char, 4096> buffer{};
    for (std::size_t count = 0; (count = std::fread(buffer.data(), 1, buffer.size(), messages)) > 0;) {
      text.append(buffer.data(), count);
    }
    while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
    const std::size_t start = text.find_last_of("\r\n");
    return start == std::string::npos ? text : text.substr(start + 1);
  }
};

Ffmpeg::Ffmpeg(const fs::path& program, const std::vector<std::string>& arguments)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.messages = std::tmpfile();
  std::array<int, 2> ends{-1, -1};
  if (self.messages == nullptr || ::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw Error(fmt::format("{}: cannot be started: {}", program.string(), std::strerror(errno)));
  }
  self.pipe = ends[1];

  std::vector<std::string> words{program.string(), "-hide_banner", "-loglevel", "error", "-y"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, ::fileno(self.messages), STDERR_FILENO);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGPIPE);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int failure =
      ::posix_spawn(&self.process, program.c_str(), &actions, &attributes, pointers.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  if (failure != 0) {
    self.process = -1;
    throw Error(fmt::format("{}: cannot be started: {}", program.string(), std::strerror(failure)));
  }
}

Ffmpeg::~Ffmpeg() = default;

void Ffmpeg::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(implementation_->pipe, bytes.data(), bytes.size());
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
  implementation_->close_pipe();
  const int status = implementation_->wait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string message = implementation_->last_message();
  throw Error(fmt::format("ffmpeg failed: {}", message.empty() ? "it gave no reason" : message));
}

}  // namespace substep
