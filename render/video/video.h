#pragma once
/// A scene as a film: several runs of it side by side.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"
#include "render/video/film_camera.h"
#include "render/video/overlay.h"
#include "sim/scene/scene.h"

namespace substep::render {

struct VideoSettings {
  ComparisonSettings comparison;
  std::string title;  ///< empty: the scene's name
  double frame_rate = 30;
  FilmCamera camera;
  Overlays overlays;
  std::vector<Strip> strips;  ///< empty: the comparison's
  bool freezes = false;       ///< where a run first leaves the reference, with a ring round the body
  int width = 1280;
  int height = 720;
  double hold = 1;                              ///< s for which the last frame stays
  std::filesystem::path output;                 ///< the film: .mp4, .webm, .gif or .apng
  std::optional<std::filesystem::path> frames;  ///< a folder for PNG files, instead of the film
  std::optional<std::filesystem::path> poster;  ///< one frame, PNG
  std::optional<double> poster_time;            ///< s; which one
  std::optional<std::filesystem::path> loop;    ///< a small film for a page, GIF, below 2 MB
  int threads = 2;                              ///< the result is the same for any number
  /// Called now and then with what is being done and its share done; may be empty.
  std::function<void(std::string_view stage, double share)> progress;
};

/// Of this process and of ffmpeg, s.
struct CpuTimes {
  double simulating = 0;
  double drawing = 0;
  double encoding = 0;
};

struct VideoReport {
  Comparison comparison;
  CpuTimes cpu;
  std::filesystem::path written;  ///< the film, or the folder of frames
  std::string film_command;       ///< of frames: the ffmpeg command that makes a film of them; else empty
};

/// Simulates and draws. The output's extension says what is written; another is an error, and so
/// is a film or a loop without ffmpeg, before anything is simulated: an earlier film of that name would pass
/// for the new one. Throws Error; then no output is left half-written.
VideoReport make_video(const Scene& scene, const VideoSettings& settings);

/// Of what is simulated already.
VideoReport make_video(const Scene& scene, const VideoSettings& settings, Comparison simulated);

}  // namespace substep::render
