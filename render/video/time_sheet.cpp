#include "render/video/time_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/renderer.h"
#include "render/text.h"
#include "render/video/comparison_table.h"
#include "render/video/composition.h"
#include "sim/error.h"

namespace substep::render {
namespace {

constexpr Color dark{40, 43, 50};
constexpr Color quiet{100, 105, 114};

/// Where things stand, in pixels.
struct Grid {
  int gap, line, left, top, width, height;
  std::size_t runs_in_row;

  Grid(const TimeSheetSettings& settings)
      : gap(gap_of(settings)),
        line(static_cast<int>(std::lround(1.4 * settings.text))),
        left(gap),
        top(gap + (settings.title.empty() ? 2 : 3) * line),
        width(settings.width),
        height(settings.height),
        runs_in_row(settings.times.size() == 1 ? static_cast<std::size_t>(settings.runs_in_row) : 1) {}

  /// Left end of a picture, of a run and one of its times.
  int x(std::size_t column, std::size_t run) const {
    return left + static_cast<int>(column + run % runs_in_row) * (width + gap);
  }
  /// Top of a picture; its run's line is above it.
  int y(std::size_t run) const {
    return top + line + static_cast<int>(run / runs_in_row) * (height + line + gap);
  }
};

/// Draws the run's title above its row, its name in its colour.
void draw_run(Image& image, const Grid& grid, std::size_t row, const Run& run, const std::string& words,
              double size) {
  const double base = grid.y(row) - 0.4 * size;
  const TextStyle bold{.size = size, .color = accent_on_white(run.panel), .bold = true};
  const std::string name = name_of(run.panel);
  const TextStyle plain{.size = size, .color = dark};
  const double words_left = text_width(name, bold) + 0.5 * size;
  const bool fits = grid.runs_in_row == 1 || words_left + text_width(words, plain) < grid.width;
  draw_text(image, grid.x(0, row), base, name, bold);
  if (fits) draw_text(image, grid.x(0, row) + words_left, base, words, plain);
}

/// Returns what the comparison's strip shows of a run at a frame, or what became of the run.
std::string note_on(const Comparison& comparison, const Run& run, std::size_t frame) {
  if (comparison.strip == Strip::error && frame < run.errors.size()) {
    return error_label(run.errors[frame], comparison.reference->uncertainty[frame]);
  }
  if (comparison.strip && comparison.strip != Strip::error &&
      frame < series_of(run, *comparison.strip).size()) {
    return axis_of(comparison, *comparison.strip).label(series_of(run, *comparison.strip)[frame]);
  }
  if (!run.refusal.empty()) return frame == 0 ? run.refusal : "";
  if (run.diverged && frame >= run.poses.size()) {
    return fmt::format("diverged at {:.2f} s", *run.diverged);
  }
  return "";
}

void draw_note(Image& image, const Grid& grid, std::size_t column, std::size_t row, const std::string& note,
               double size) {
  if (note.empty()) return;
  const TextStyle style{.size = 0.9 * size, .color = dark, .bold = true};
  const int wide = static_cast<int>(std::lround(text_width(note, style) + 0.8 * size));
  const int x = grid.x(column, row) + grid.width - wide;
  const int y = grid.y(row) + grid.height - grid.line;
  fill_rectangle(image, x, y, wide, grid.line, {255, 255, 255}, 0.75);
  draw_text(image, x + 0.4 * size, y + 0.5 * grid.line + 0.3 * size, note, style);
}

Comparison simulated(const Scene& scene, const TimeSheetSettings& settings) {
  ComparisonSettings comparison = settings.comparison;
  comparison.start = 0;
  comparison.duration = settings.times.back() + 0.5 * comparison.step;
  comparison.frame_interval = comparison.step;
  return simulate_comparison(scene, comparison, [&](double share) {
    if (settings.progress) settings.progress("simulating", share);
  });
}

/// All poses that are shown, for the camera.
std::vector<std::vector<Coordinates>> shown_poses(const TimeSheet& sheet) {
  std::vector<std::vector<Coordinates>> shown;
  for (const Run& run : sheet.comparison.runs) {
    for (const std::size_t frame : sheet.frames) {
      if (frame < run.poses.size()) shown.push_back(run.poses[frame]);
    }
  }
  return shown;
}

}  // namespace

int gap_of(const TimeSheetSettings& settings) {
  return static_cast<int>(std::lround(0.5 * settings.text));
}

TimeSheet draw_time_sheet(const Scene& scene, const TimeSheetSettings& settings) {
  RenderSettings pictures;
  pictures.width = settings.width;
  pictures.height = settings.height;
  check(pictures);
  const Grid grid(settings);
  const std::size_t rows = settings.comparison.panels.size();
  RenderSettings whole;
  const std::size_t columns = settings.times.size() - 1 + grid.runs_in_row;
  whole.width = grid.x(columns, 0);
  whole.height = grid.y(rows + grid.runs_in_row - 1) - grid.line;
  check(whole);

  TimeSheet sheet{Image(whole.width, whole.height), simulated(scene, settings), {}};
  std::ranges::fill(sheet.image.rgb, std::uint8_t{255});
  for (const double time : settings.times) {
    sheet.frames.push_back(static_cast<std::size_t>(std::lround(time / settings.comparison.step)));
  }
  const Comparison& comparison = sheet.comparison;
  if (!settings.title.empty()) {
    draw_text(sheet.image, grid.left, grid.gap + settings.text, settings.title,
              {.size = 1.2 * settings.text, .color = dark, .bold = true});
  }
  const Titles titles = titles_of(comparison.runs);
  const std::string notes = comparison.strip ? words_of(comparison, *comparison.strip) : "";
  const std::string legend = titles.shared + (titles.shared.empty() || notes.empty() ? "" : " · ") + notes;
  TextStyle small{.size = settings.text, .color = quiet};
  while (small.size > 6 && text_width(legend, small) > whole.width - 2 * grid.gap) small.size *= 0.97;
  draw_text(sheet.image, grid.left, grid.top - 1.4 * grid.line, legend, small);
  Renderer renderer(seen_by(settings.camera, scene), pictures, shown_poses(sheet));
  for (std::size_t column = 0; column < sheet.frames.size(); ++column) {
    const std::size_t frame = sheet.frames[column];
    draw_text(sheet.image, grid.x(column, 0), grid.top - 0.4 * settings.text,
              fmt::format("{:g} s", std::round(1e4 * comparison.times[frame]) / 1e4),
              {.size = settings.text, .color = dark, .bold = true});
    for (std::size_t row = 0; row < rows; ++row) {
      const Run& run = comparison.runs[row];
      if (column == 0) draw_run(sheet.image, grid, row, run, titles.words[row], settings.text);
      if (!run.poses.empty()) {
        const std::size_t last = std::min(frame, run.poses.size() - 1);
        paste(sheet.image, renderer.draw(run.poses[last]), grid.x(column, row), grid.y(row));
      }
      draw_note(sheet.image, grid, column, row, note_on(comparison, run, frame), settings.text);
      if (settings.progress) {
        settings.progress("drawing", static_cast<double>(column * rows + row + 1) /
                                         static_cast<double>(rows * sheet.frames.size()));
      }
    }
  }
  return sheet;
}

}  // namespace substep::render
