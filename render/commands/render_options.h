#pragma once
/// What `substep render` draws, as typed, and its layouts with several pictures in one.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/commands/comparison_options.h"
#include "render/commands/run_input.h"

namespace substep::render {

struct RenderOptions {
  RunInput run;                               ///< its file is the first of `inputs`
  std::vector<std::filesystem::path> inputs;  ///< several for the layout sheet alone
  std::string layout = "frames";              ///< frames, strobe, sheet or stills
  std::vector<std::string> frames;            ///< numbers; with no frame and no time: the first
  std::vector<std::string> times;             ///< s
  bool asks_for_run = false;                  ///< an option that only a simulated scene has was typed
  std::string camera = "scene";
  std::optional<std::string> size;  ///< of one picture
  std::optional<std::filesystem::path> output;
  // Of sheets.
  int columns = 6;
  // Of stills.
  ComparisonOptions comparison;      ///< the panels
  std::optional<std::string> width;  ///< of all, for print
  double dpi = 300;
  double text = 8;  ///< points
};

/// Draws one labelled picture of each scene. Throws Error.
void draw_sheet(const RenderOptions& options);

/// Draws a row for each panel, a column for each time. Throws Error.
void draw_stills(const RenderOptions& options);

}  // namespace substep::render
