#pragma once
/// The program ffmpeg at the other end of a pipe.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace substep::render {

/// Where ffmpeg is, looked for in PATH.
std::optional<std::filesystem::path> find_ffmpeg();

/// Reading frames of this size from its standard input, as raw RGB.
std::vector<std::string> raw_frames_input(int width, int height, double frame_rate);

/// What a film is written as: H.264 in MP4, VP9 in WebM, an animated GIF of 256 colours a frame, an animated
/// PNG.
enum class Container { mp4, webm, gif, apng };

/// By the file's extension; nothing where it names none of them.
std::optional<Container> container_of(const std::filesystem::path& file);

/// Everything between the input and the name of the output. The bytes of MP4, GIF and APNG are the same on
/// every machine and for every number of threads.
std::vector<std::string> film_output(Container container);

/// As one would type it in a shell.
std::string command_line(const std::vector<std::string>& arguments);

/// How long ffmpeg may do nothing: neither take what it is given nor make its file larger. A palette of a
/// whole film, the longest that it works unseen, takes seconds.
inline constexpr std::chrono::milliseconds ffmpeg_patience = std::chrono::minutes(2);

/// A running ffmpeg, fed through a pipe, without a shell. While it lives, SIGPIPE is ignored.
class Ffmpeg {
 public:
  /// Starts `program` with `arguments`. `output` is the file that it writes, if any. Throws Error.
  Ffmpeg(const std::filesystem::path& program, const std::vector<std::string>& arguments,
         std::filesystem::path output = {}, std::chrono::milliseconds patience = ffmpeg_patience);
  ~Ffmpeg();  ///< ends it when finish() was not reached
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  void write(std::span<const std::uint8_t> bytes);  ///< throws Error with what ffmpeg said when it has ended
  /// Waits for its end; throws Error when it failed or complained: it may end with code 0 after an error.
  /// Returns what it wrote to its standard output.
  std::string finish();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Throws Error unless ffmpeg reads the film to its end without complaint and finds so many frames in it.
void require_whole_film(const std::filesystem::path& program, const std::filesystem::path& film, int frames);

}  // namespace substep::render
