#pragma once
/// One picture of several runs at chosen times: a row for each run, a column for each time.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "render/image.h"
#include "render/video/comparison.h"
#include "render/video/film_camera.h"

namespace substep::render {

struct TimeSheetSettings {
  ComparisonSettings comparison;  ///< the sheet sets start, duration and frame interval
  std::vector<double> times;      ///< s, ascending: the nearest steps are shown
  int runs_in_row = 1;            ///< for a single time
  std::string title;              ///< at the top; empty: none
  int width = 1280;               ///< of one picture, pixels
  int height = 720;
  double text = 16;   ///< size, pixels
  FilmCamera camera;  ///< one that does not move
  /// Receives the current task and the fraction done; may be empty.
  std::function<void(std::string_view stage, double fraction)> progress;
};

/// Returns the gap between pictures, pixels.
int gap_of(const TimeSheetSettings& settings);

struct TimeSheet {
  Image image;
  Comparison comparison;
};

/// Simulates and draws the runs. Each picture shows its value of the strip's quantity. Throws Error.
TimeSheet draw_time_sheet(const Scene& scene, const TimeSheetSettings& settings);

}  // namespace substep::render
