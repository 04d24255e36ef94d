#include "render/video/time_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "render/renderer.h"
#include "render/text.h"
#include "render/video/strips.h"
#include "render/video/titles.h"

namespace substep::render {
namespace {

constexpr Color text_color{40, 43, 50};
constexpr Color quiet{100, 105, 114};

/// The layout in pixels. A sheet of a single time has several runs in a row; later rows may have one run
/// less, in wider pictures.
struct Grid {
  int gap, line, top;
  int most;                   ///< runs in a full row
  int width, height;          ///< of the sheet
  std::vector<Box> pictures;  ///< of each run at the first time, below the run's title

  Grid(const TimeSheetSettings& settings)
      : gap(gap_of(settings)),
        line(static_cast<int>(std::lround(1.4 * settings.text))),
        top(gap + (settings.title.empty() ? 2 : 3) * line) {
    const int count = static_cast<int>(settings.comparison.panels.size());
    const int in_row = settings.times.size() == 1 ? settings.runs_in_row : 1;
    const int rows = (count + in_row - 1) / in_row;
    most = (count + rows - 1) / rows;
    const int pitch = settings.height + line + gap;
    width = gap + (static_cast<int>(settings.times.size()) - 1 + most) * (settings.width + gap);
    height = top + rows * pitch;
    for (int row = 0; row < rows; ++row) {
      const int columns = count / rows + (row < count % rows ? 1 : 0);
      const int wide = (most * (settings.width + gap) - columns * gap) / columns;
      for (int column = 0; column < columns; ++column)
        pictures.push_back({gap + column * (wide + gap), top + line + row * pitch, wide, settings.height});
    }
  }

  /// Returns the left edge of a run's picture in a column of times.
  int x(std::size_t column, std::size_t run) const {
    return pictures[run].x + static_cast<int>(column) * (pictures[run].width + gap);
  }
};

/// Draws a run's name, in its colour, and its title above the run's first picture.
void draw_run(Image& image, const Grid& grid, std::size_t index, const Run& run, const std::string& words,
              double size) {
  const double base = grid.pictures[index].y - 0.4 * size;
  const TextStyle bold{.size = size, .color = accent_on_white(run.panel), .bold = true};
  const std::string name = name_of(run.panel);
  const TextStyle plain{.size = size, .color = text_color};
  const double words_left = text_width(name, bold) + 0.5 * size;
  const int room = grid.most == 1 ? image.width - 2 * grid.gap : grid.pictures[index].width;
  draw_text(image, grid.x(0, index), base, name, bold);
  draw_text(image, grid.x(0, index) + words_left, base, cut(words, plain, room - words_left), plain);
}

/// Returns a run's value of the comparison's strip at a frame; without one, the reason of an early end of the
/// run, or of the reference.
std::string note_on(const Comparison& comparison, const Run& run, std::size_t frame) {
  if (run.is_reference() && frame >= comparison.reference->known)
    return "no reference: " + comparison.reference->fate;
  if (comparison.strip == Strip::error && frame < run.errors.size()) {
    return error_label(run.errors[frame], comparison.reference->uncertainty[frame]);
  }
  if (comparison.strip && comparison.strip != Strip::error) {
    const std::vector<double>& values = series_of(run, *comparison.strip);
    if (frame < values.size()) return axis_of(comparison, *comparison.strip).label(values[frame]);
  }
  if (!run.refusal.empty()) return frame == 0 ? run.refusal : "";
  if (run.diverged && frame >= run.poses.size()) {
    return fmt::format("diverged at {:.2f} s", *run.diverged);
  }
  return "";
}

void draw_note(Image& image, const Grid& grid, std::size_t column, std::size_t run, const std::string& note,
               double size) {
  if (note.empty()) return;
  const Box& box = grid.pictures[run];
  const TextStyle style{.size = 0.9 * size, .color = text_color, .bold = true};
  const std::vector<std::string> lines = wrapped(note, style, box.width - 0.8 * size);
  double widest = 0;
  for (const std::string& line : lines) widest = std::max(widest, text_width(line, style));
  const int wide = static_cast<int>(std::lround(widest + 0.8 * size));
  const int x = grid.x(column, run) + box.width - wide;
  const int high = grid.line * static_cast<int>(lines.size());
  int y = box.y + box.height - high;
  fill_rectangle(image, x, y, wide, high, {255, 255, 255}, 0.75);
  for (const std::string& line : lines) {
    draw_text(image, x + 0.4 * size, y + 0.5 * grid.line + 0.3 * size, line, style);
    y += grid.line;
  }
}

Comparison simulated(const Scene& scene, const TimeSheetSettings& settings) {
  ComparisonSettings comparison = settings.comparison;
  comparison.start = 0;
  comparison.duration = settings.times.back() + 0.5 * comparison.step;
  comparison.frame_interval = comparison.step;
  return simulate_comparison(scene, comparison, [&](double fraction) {
    if (settings.progress) settings.progress("simulating", fraction);
  });
}

/// Draws the sheet's title, and below it the settings of all runs and the quantity of their notes.
void draw_head(Image& image, const Grid& grid, const TimeSheetSettings& settings,
               const Comparison& comparison, const std::string& shared) {
  // Draw a line of text, as large as fits.
  const auto draw_line = [&](double base, const std::string& text, TextStyle style) {
    const int room = image.width - 2 * grid.gap;
    while (style.size > 6 && text_width(text, style) > room) style.size *= 0.97;
    draw_text(image, grid.gap, base, cut(text, style, room), style);
  };
  draw_line(grid.gap + settings.text, settings.title,
            {.size = 1.2 * settings.text, .color = text_color, .bold = true});
  const std::string notes = comparison.strip ? words_of(comparison, *comparison.strip) : "";
  const std::string legend = shared + (shared.empty() || notes.empty() ? "" : " · ") + notes;
  draw_line(grid.top - 1.4 * grid.line, legend, {.size = settings.text, .color = quiet});
}

}  // namespace

int gap_of(const TimeSheetSettings& settings) {
  return static_cast<int>(std::lround(0.5 * settings.text));
}

TimeSheet draw_time_sheet(const Scene& scene, const TimeSheetSettings& settings) {
  RenderSettings pictures{
      .width = settings.width, .height = settings.height, .steps_back = !settings.camera.named};
  check(pictures);
  const Grid grid(settings);
  const std::size_t runs = settings.comparison.panels.size();
  check({.width = grid.width, .height = grid.height});

  TimeSheet sheet{Image(grid.width, grid.height), simulated(scene, settings)};
  Image& image = sheet.image;
  const Comparison& comparison = sheet.comparison;
  std::ranges::fill(image.rgb, std::uint8_t{255});
  const Titles titles = titles_of(comparison.runs);
  draw_head(image, grid, settings, comparison, titles.shared);
  std::vector<std::size_t> frames;
  for (const double time : settings.times)
    frames.push_back(static_cast<std::size_t>(std::lround(time / settings.comparison.step)));
  // Make a renderer for each width of pictures; its camera sees the frames that a film's camera sees.
  const std::vector<std::vector<Coordinates>> seen = seen_frames(scene, comparison);
  std::map<int, Renderer> renderers;
  for (std::size_t run = 0; run < runs; ++run) {
    pictures.width = grid.pictures[run].width;
    if (renderers.contains(pictures.width)) continue;
    renderers.try_emplace(pictures.width, seen_by(settings.camera, scene), pictures, seen);
  }
  for (std::size_t column = 0; column < frames.size(); ++column) {
    const std::size_t frame = frames[column];
    draw_text(image, grid.x(column, 0), grid.top - 0.4 * settings.text,
              fmt::format("{:g} s", std::round(1e4 * comparison.times[frame]) / 1e4),
              {.size = settings.text, .color = text_color, .bold = true});
    for (std::size_t index = 0; index < runs; ++index) {
      const Run& run = comparison.runs[index];
      if (column == 0) draw_run(image, grid, index, run, titles.words[index], settings.text);
      if (!run.poses.empty()) {
        const std::size_t last = std::min(frame, run.poses.size() - 1);
        paste(image, renderers.at(grid.pictures[index].width).draw(run.poses[last]), grid.x(column, index),
              grid.pictures[index].y);
      }
      draw_note(image, grid, column, index, note_on(comparison, run, frame), settings.text);
      if (settings.progress) {
        settings.progress("drawing", static_cast<double>(column * runs + index + 1) /
                                         static_cast<double>(runs * frames.size()));
      }
    }
  }
  return sheet;
}

}  // namespace substep::render
