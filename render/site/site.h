#pragma once
/// Scenes as a folder of pages for a web server.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "render/video/comparison.h"

namespace substep::render {

struct SiteSettings {
  std::vector<std::filesystem::path> scenes;
  std::filesystem::path folder;
  std::string title = "Scenes";
  bool films = false;      ///< films each scene, too, which takes minutes
  double frame_rate = 30;  ///< frames in a second of film
  double speed = 1;        ///< s of the scene in a second of film
  // All functions must be set.

  /// Reads a scene. Throws Error.
  std::function<Scene(const std::filesystem::path&)> load;
  /// Returns the runs that are compared in a scene. Throws Error.
  std::function<ComparisonSettings(const Scene&)> comparison;
  /// Receives the current task and the fraction done.
  std::function<void(std::string_view stage, double fraction)> progress;
  /// Receives the file of each scene that could not be shown, and the reason.
  std::function<void(const std::filesystem::path& scene, std::string_view why)> failure;
};

/// Writes a folder for each scene with its page, player and poster, and an index. Returns the number of
/// scenes that could be shown. A scene's folder is complete or absent. Throws Error where two scenes have
/// one name, or `folder` holds anything but an earlier site.
int make_site(const SiteSettings& settings);

}  // namespace substep::render
