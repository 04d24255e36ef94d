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
  std::string title;       ///< empty: the scene's name
  double frame_rate = 30;  ///< frames in a second of film
  FilmCamera camera;
  Overlays overlays;
  std::vector<Strip> strips;  ///< empty: the comparison's
  bool freezes = false;       ///< stands still where a run diverges from the reference
  int width = 1280;
  int height = 720;
  double hold = 1;                              ///< time for which the last frame stays, s
  std::filesystem::path output;                 ///< the film: .mp4, .webm, .gif or .apng
  std::optional<std::filesystem::path> frames;  ///< a folder for PNG files, instead of the film
  std::optional<std::filesystem::path> poster;  ///< the frame at 60 % of the film, PNG
  std::optional<std::filesystem::path> loop;    ///< a small film for a page, GIF, below 2 MB
  /// Receives the current task and the fraction done; must be set.
  std::function<void(std::string_view stage, double fraction)> progress;
};

struct VideoReport {
  Comparison comparison;
  std::string film_command;  ///< the ffmpeg command that makes a film of the frames; else empty
};

/// Draws a film of runs, and simulates them unless they were `simulated` already. The output's extension
/// names its container. Throws Error for another extension, or where ffmpeg is missing, before it simulates
/// and writes.
VideoReport make_video(const Scene& scene, const VideoSettings& settings,
                       std::optional<Comparison> simulated = {});

}  // namespace substep::render
