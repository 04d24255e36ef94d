#include "render/report/plot_layout.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "render/text.h"

namespace substep::report {
namespace {

constexpr double right_margin = 16;  // also room for half of a tic's label
constexpr double text_size = 12;

/// Returns the style of text in the figures' font.
render::TextStyle text_style(double size) {
  constexpr double from_ascender_to_descender = 1.164;  // of DejaVu Sans, in its size
  return {.size = size * from_ascender_to_descender};
}

/// Returns the widest text of an axis' tics, whether given or gnuplot's own.
double tics_width(const Axis& axis) {
  if (axis.tics.empty()) return width_of(axis.logarithmic ? "10-10" : "-0.0005", text_size);
  double widest = width_of("1000", text_size);
  for (std::size_t at = axis.tics.find('"'); at != std::string::npos;) {
    const std::size_t end = axis.tics.find('"', at + 1);
    widest = std::max(widest, width_of(axis.tics.substr(at + 1, end - at - 1), text_size));
    at = axis.tics.find('"', end + 1);
  }
  return widest;
}

/// Sets the panels' margins, number of columns and size.
void place_panels(const Sheet& sheet, bool is_print, Layout& layout) {
  double tics = 0;
  bool has_title = false;
  double x_title = 0;
  bool has_y = false;
  for (const Panel& panel : sheet.panels) {
    tics = std::max(tics, tics_width(panel.y));
    has_title = has_title || !panel.title.empty();
    x_title = std::max(x_title, width_of(panel.x.title, text_size));
    has_y = has_y || !panel.y.title.empty();
  }
  layout.left_margin = 12 + tics + (has_y ? 22 : 4);
  layout.top_margin = has_title ? 28 : 12;
  layout.bottom_margin = x_title > 0 ? 47 : 26;
  const auto count = static_cast<int>(sheet.panels.size());
  layout.columns = std::min(sheet.columns, count);
  if (is_print) {
    // Leave each plot room for tics and title, somewhat less where all panels stand in one row.
    const auto fitting = [&](double least) {
      const double plot = std::max(least, x_title - 2 * right_margin);
      return std::clamp(static_cast<int>(layout.width / (layout.left_margin + plot + right_margin)), 1,
                        count);
    };
    layout.columns = fitting(154) == count ? count : fitting(204);
  }
  layout.panel_width = layout.width / layout.columns;
  layout.panel_height = is_print ? std::clamp(0.64 * layout.panel_width, 200.0, 280.0)
                                 : std::clamp(0.4 * layout.panel_width, sheet.panel_height, 480.0);
}

/// Places the legend's entries in columns of equal width below `top`, and returns the legend's bottom.
double place_legend(const Sheet& sheet, double top, Layout& layout) {
  constexpr double between = 18;
  constexpr double border = 8;
  const double room = layout.width - 2 * border;
  double widest = 0;
  for (const auto& [title, style] : series_titles(sheet)) {
    LegendEntry entry{render::wrapped(title, text_style(text_size), room - sample_width - sample_gap), style};
    for (const std::string& line : entry.lines)
      widest = std::max(widest, sample_width + sample_gap + width_of(line, text_size));
    layout.legend.push_back(std::move(entry));
  }
  if (layout.legend.empty()) return top;
  const auto count = static_cast<int>(layout.legend.size());
  const int most = std::clamp(static_cast<int>((room + between) / (widest + between)), 1, count);
  const int rows = (count + most - 1) / most;
  const int columns = (count + rows - 1) / rows;
  const double left = 0.5 * (layout.width - columns * widest - (columns - 1) * between);
  double y = top;
  for (int row = 0; row < rows; ++row) {
    std::size_t lines = 1;
    for (int i = row * columns; i < std::min((row + 1) * columns, count); ++i) {
      LegendEntry& entry = layout.legend[static_cast<std::size_t>(i)];
      entry.x = left + (i - row * columns) * (widest + between);
      entry.y = y + 0.5 * line_height;
      lines = std::max(lines, entry.lines.size());
    }
    y += static_cast<double>(lines) * line_height;
  }
  return y;
}

/// Returns "Left out: A2 of crane (6 runs lost)." or, of many series, their number.
std::string left_out_line(const std::vector<LeftOut>& left_out) {
  constexpr std::size_t most = 3;
  if (left_out.empty()) return "";
  if (left_out.size() > most)
    return fmt::format("Left out: {} series, each with its reason in the figure's .txt.", left_out.size());
  std::vector<std::string> parts;
  for (const LeftOut& one : left_out)
    parts.push_back(fmt::format("{} of {} ({})", one.series, one.scene, one.reason));
  return fmt::format("Left out: {}.", fmt::join(parts, "; "));
}

}  // namespace

double Layout::left(std::size_t panel) const {
  return static_cast<double>(panel % static_cast<std::size_t>(columns)) * panel_width + left_margin;
}
double Layout::right(std::size_t panel) const {
  return left(panel) + panel_width - left_margin - right_margin;
}
double Layout::top(std::size_t panel) const {
  return panels_top + static_cast<double>(panel / static_cast<std::size_t>(columns)) * panel_height +
         top_margin;
}
double Layout::bottom(std::size_t panel) const {
  return top(panel) + panel_height - top_margin - bottom_margin;
}

double width_of(const std::string& text, double size) {
  return render::text_width(text, text_style(size));
}

std::vector<std::pair<std::string, SeriesStyle>> series_titles(const Sheet& sheet) {
  std::vector<std::pair<std::string, SeriesStyle>> titles;
  for (const Panel& panel : sheet.panels) {
    for (const Series& series : panel.series) {
      const auto is_same = [&](const auto& entry) { return entry.first == series.title; };
      if (std::ranges::none_of(titles, is_same)) titles.emplace_back(series.title, series.style);
    }
  }
  return titles;
}

Layout layout_of(const Sheet& sheet, const FigureStyle& style, double width) {
  const bool is_print = style.width.has_value();
  Layout layout;
  layout.width = width > 0 ? width : sheet.width;
  layout.title_size = is_print ? 13 : 15;
  if (style.title) {
    layout.title = render::wrapped(sheet.title, text_style(layout.title_size), layout.width - 16);
  }
  layout.panels_top =
      4 + (style.title ? (is_print ? 6 : 18) + 18 * static_cast<double>(layout.title.size()) : 0);
  place_panels(sheet, is_print, layout);
  const int rows = (static_cast<int>(sheet.panels.size()) + layout.columns - 1) / layout.columns;
  layout.height = place_legend(sheet, layout.panels_top + rows * layout.panel_height + 6, layout) + 6;
  if (!style.caption) return layout;
  std::vector<std::string> lines = sheet.caption;
  if (const std::string line = left_out_line(sheet.left_out); !line.empty()) lines.push_back(line);
  // Join the caption's lines to one paragraph in print.
  if (is_print) lines = {fmt::format("{}", fmt::join(lines, " "))};
  for (const std::string& line : lines) {
    std::ranges::move(render::wrapped(line, text_style(caption_size), layout.width - 16),
                      std::back_inserter(layout.caption));
  }
  layout.caption_top = layout.height + 0.5 * line_height;
  layout.height += static_cast<double>(layout.caption.size()) * line_height + 4;
  return layout;
}

}  // namespace substep::report
