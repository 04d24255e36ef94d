#pragma once
/// The program ffmpeg at the other end of a pipe.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/execution/child_process.h"
#include "sim/log/file_output.h"

namespace substep::render {

/// Returns the path of ffmpeg in PATH; nothing where it is missing.
std::optional<std::filesystem::path> find_ffmpeg();

/// Returns the arguments that read frames of this size from standard input, as raw RGB.
std::vector<std::string> raw_frames_input(int width, int height, double frame_rate);

/// Containers: H.264 in MP4, VP9 in WebM, an animated GIF of 256 colours a frame, an animated PNG.
enum class Container { mp4, webm, gif, apng };

/// Returns the container of a file's extension; nothing for other extensions.
std::optional<Container> container_of(const std::filesystem::path& file);

/// Returns the arguments between the input and the output's name. The bytes of MP4, GIF and APNG are the same
/// on every machine and for every number of threads.
std::vector<std::string> film_output(Container container);

/// Returns the command as one would type it in a shell.
std::string command_line(const std::vector<std::string>& arguments);

/// Longest time for which ffmpeg may neither read its input nor enlarge its file. A palette of a whole film,
/// its longest silent work, takes seconds.
inline constexpr std::chrono::milliseconds ffmpeg_patience = std::chrono::minutes(2);

/// A running ffmpeg, fed through a pipe, without a shell. While it lives, SIGPIPE is ignored.
class Ffmpeg {
 public:
  /// Starts `program` with `arguments`. `output` is the file that it writes, if any. Throws Error.
  Ffmpeg(const std::filesystem::path& program, const std::vector<std::string>& arguments,
         std::filesystem::path output = {}, std::chrono::milliseconds patience = ffmpeg_patience);
  ~Ffmpeg();  ///< ends ffmpeg unless finish() was called
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  void write(std::span<const std::uint8_t> bytes);  ///< throws Error with ffmpeg's message when it has ended
  /// Waits for ffmpeg's end and returns its standard output. Throws Error when it failed or complained: it
  /// may end with code 0 after an error.
  std::string finish();

 private:
  using Clock = std::chrono::steady_clock;

  void close_pipe();
  void require_progress();

  TemporaryFile messages_;
  TemporaryFile answer_;
  std::optional<ChildProcess> process_;
  std::optional<PartialFileWriter> writer_;  ///< of `process_`, while it runs
  int pipe_ = -1;
  std::filesystem::path output_;
  std::chrono::milliseconds patience_;
  std::uintmax_t size_ = 0;  ///< of `output_` at the last check
  Clock::time_point last_progress_ = Clock::now();
  struct sigaction previous_ {};
};

/// Throws Error unless ffmpeg reads the film to its end without complaint and finds this number of frames.
void require_whole_film(const std::filesystem::path& program, const std::filesystem::path& film, int frames);

}  // namespace substep::render
