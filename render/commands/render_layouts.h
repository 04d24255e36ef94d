#pragma once
/// The typed options of `substep render`, and its layouts with several pictures in one.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/options.h"

namespace substep::render {

struct RenderOptions {
  RunInput run;                               ///< its file is the first of `inputs`
  std::vector<std::filesystem::path> inputs;  ///< several for the layout sheet alone
  std::string layout = "frames";              ///< frames, strobe, sheet or stills
  std::vector<std::string> frames;            ///< numbers; without frames and times: the first
  std::vector<std::string> times;             ///< s
  bool has_run_option = false;                ///< whether an option of simulated scenes was typed
  std::string camera = "scene";
  std::optional<std::string> size;  ///< of one picture
  std::optional<std::filesystem::path> output;
  int columns = 6;                   ///< of sheets
  ComparisonOptions comparison;      ///< panels of stills
  std::optional<std::string> width;  ///< of stills in print
  double dpi = 300;                  ///< of stills
  double text = 8;                   ///< of stills, points
};

/// Draws one labelled picture of each scene. Throws Error.
void draw_sheet(const RenderOptions& options);

/// Draws a row for each panel, a column for each time. Throws Error.
void draw_stills(const RenderOptions& options);

}  // namespace substep::render
