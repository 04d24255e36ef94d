#include "render/report/plot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "render/inks.h"
#include "render/report/gnuplot.h"
#include "sim/error.h"

namespace substep::report {
namespace {

constexpr render::Ink text_ink{"#222222", "#e6e6e6"};
constexpr render::Ink frame_ink{"#b8b8b8", "#5a5a5a"};
constexpr render::Ink paper{"#ffffff", "#14171a"};

constexpr double line_height = 17;
constexpr double right_margin = 16;
constexpr double top_margin = 30;
constexpr double bottom_margin = 54;

bool can_be_drawn(const std::array<double, 2>& point, const Panel& panel) {
  return std::isfinite(point[0]) && std::isfinite(point[1]) && (!panel.x.logarithmic || point[0] > 0) &&
         (!panel.y.logarithmic || point[1] > 0);
}

std::string style_of(const Look& look) {
  const std::string line =
      fmt::format("lc rgb '{}' lw 1.8 dt {}", render::inks.at(look.hue).light, look.dashed ? 2 : 1);
  const std::string points = fmt::format("pt {} ps 0.75", look.shape);
  if (!look.line) return fmt::format("with points {} lc rgb '{}'", points, render::inks.at(look.hue).light);
  if (!look.points) return fmt::format("with lines {}", line);
  return fmt::format("with linespoints {} {}", line, points);
}

/// gnuplot's text between single quotes; its marks for subscripts are letters here.
std::string quoted_text(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '_') result += '\\';
    if (c == '\'') result += c;
    result += c;
  }
  result += '\'';
  return result;
}

/// How far the y axis' title is moved towards its tics, in letters. For print gnuplot leaves no room for tics
/// that are given.
const char* y_offset(const Axis& axis, bool is_print) {
  if (!is_print) return "1.2,0";
  return axis.tics.empty() ? "0.6,0" : "-0.4,0";
}

std::string axis_script(const char* name, const Axis& axis, bool is_print) {
  std::string script = fmt::format("set {0}label {1} offset {3}\n{2} logscale {0}\nset autoscale {0}\n", name,
                                   quoted_text(axis.title), axis.logarithmic ? "set" : "unset",
                                   name[0] == 'x' ? "0,0.7" : y_offset(axis, is_print));
  if (axis.logarithmic && axis.tics.empty()) {
    script += fmt::format("set format {} '10^{{%T}}'\n", name);
  } else {
    script += fmt::format("set format {} '%g'\n", name);
  }
  if (axis.range)
    script += fmt::format("set {}range [{:g}:{:g}]\n", name, (*axis.range)[0], (*axis.range)[1]);
  if (!axis.tics.empty()) script += fmt::format("set {}tics {}\n", name, axis.tics);
  return script;
}

std::string triangle_script(const std::vector<SlopeTriangle>& triangles) {
  std::string script = "unset arrow\nunset label\n";
  for (const SlopeTriangle& t : triangles) {
    const double x = t.x * t.width;
    const double y = t.y * std::pow(t.width, t.slope);
    const auto line = [&](double x0, double y0, double x1, double y1) {
      script += fmt::format("set arrow from {:g},{:g} to {:g},{:g} nohead lc rgb '{}' lw 1.2 front\n", x0, y0,
                            x1, y1, render::inks[7].light);
    };
    line(t.x, t.y, x, t.y);
    line(x, t.y, x, y);
    line(t.x, t.y, x, y);
    script += fmt::format("set label '{:g}' at {:g},{:g} left offset 0.4,0 tc rgb '{}' front\n", t.slope, x,
                          t.y * std::pow(t.width, t.slope / 2), render::inks[7].light);
  }
  return script;
}

std::string notes_script(const std::vector<Note>& notes) {
  std::string script;
  for (const Note& note : notes) {
    script += fmt::format("set label {} at {:g},{:g} {} font ',11' tc rgb '{}' front\n",
                          quoted_text(note.text), note.x, note.y,
                          note.to_the_left ? "right offset -0.9,0" : "left offset 0.9,0", text_ink.light);
  }
  return script;
}

struct Entry {
  std::string title;
  Look look;
};

/// The legend: each title once, in the order in which they come.
std::vector<Entry> legend_of(const Sheet& sheet) {
  std::vector<Entry> entries;
  for (const Panel& panel : sheet.panels) {
    for (const Series& series : panel.series) {
      if (std::ranges::none_of(entries, [&](const Entry& entry) { return entry.title == series.title; })) {
        entries.push_back({series.title, series.look});
      }
    }
  }
  return entries;
}

/// In units of which the text's size is 12: on screens, pixels.
struct Layout {
  double width;
  double height;
  double panels_top;
  double title_size;
  std::vector<std::string> title;  ///< its lines
  double legend_top;               ///< y of the legend's top edge, from the top
  double caption_top;              ///< y of the caption's first line's middle
};

/// Lines broken between words, so that none is wider than `most` characters.
std::vector<std::string> wrapped(const std::vector<std::string>& lines, int most) {
  std::vector<std::string> result;
  for (const std::string& line : lines) {
    std::string now;
    int width = 0;
    std::size_t begin = 0;
    while (begin < line.size()) {
      const std::size_t end = std::min(line.find(' ', begin), line.size());
      const std::string word = line.substr(begin, end - begin);
      // Bytes that go on with a character of UTF-8 have no width.
      const auto letters =
          static_cast<int>(std::ranges::count_if(word, [](char c) { return (c & 0xc0) != 0x80; }));
      if (width > 0 && width + 1 + letters > most) {
        result.push_back(now);
        now.clear();
        width = 0;
      }
      now += (width > 0 ? " " : "") + word;
      width += (width > 0 ? 1 : 0) + letters;
      begin = end + 1;
    }
    result.push_back(now);
  }
  return result;
}

Layout layout_of(const Sheet& sheet, std::size_t entries, const FigureStyle& style) {
  const int columns = std::min<int>(sheet.columns, static_cast<int>(sheet.panels.size()));
  const int rows = (static_cast<int>(sheet.panels.size()) + columns - 1) / columns;
  const int legend_rows = (static_cast<int>(entries) + sheet.legend_columns - 1) / sheet.legend_columns;
  Layout layout{};
  layout.width = columns * sheet.panel_width;
  layout.title_size = style.width ? 13 : 15;
  if (style.title) layout.title = {sheet.title};
  // Of its font, letters are some 7.6 wide.
  if (style.title && style.width) layout.title = wrapped(layout.title, static_cast<int>(layout.width / 7.6));
  layout.panels_top = 4 + (style.title ? 22 + 18 * static_cast<double>(layout.title.size()) : 0);
  layout.legend_top = layout.panels_top + rows * sheet.panel_height + 12;
  const double legend_end = layout.legend_top + legend_rows * (line_height + 2);
  layout.caption_top = legend_end + 20;
  layout.height = layout.caption_top + static_cast<double>(sheet.caption.size()) * line_height + 2;
  if (sheet.caption.empty()) layout.height = legend_end + 4;
  return layout;
}

std::string panel_script(const Sheet& sheet, std::size_t index, const Layout& layout, bool is_print) {
  const Panel& panel = sheet.panels[index];
  const auto column = static_cast<double>(index % sheet.columns);
  const auto row = static_cast<double>(index / sheet.columns);
  const double left = column * sheet.panel_width + sheet.left_margin;
  const double top = layout.panels_top + row * sheet.panel_height + top_margin;
  std::string script;
  std::vector<std::string> plots;
  for (std::size_t i = 0; i < panel.series.size(); ++i) {
    script += fmt::format("$data{} << END\n", i);
    int count = 0;
    for (const auto& point : panel.series[i].points) {
      if (!can_be_drawn(point, panel)) continue;
      script += fmt::format("{:.9g} {:.9g}\n", point[0], point[1]);
      ++count;
    }
    script += "END\n";
    if (count > 0) plots.push_back(fmt::format("$data{} {} notitle", i, style_of(panel.series[i].look)));
  }
  script += fmt::format(
      "set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\nset tmargin at screen {:.6f}\nset bmargin "
      "at "
      "screen {:.6f}\nset title {} offset 0,-0.6\n",
      left / layout.width, (left + sheet.panel_width - sheet.left_margin - right_margin) / layout.width,
      1 - top / layout.height, 1 - (top + sheet.panel_height - top_margin - bottom_margin) / layout.height,
      quoted_text(panel.title));
  script += "set xtics out nomirror scale 0.5 autofreq\nset ytics out nomirror scale 0.5 autofreq\n";
  script += axis_script("x", panel.x, is_print) + axis_script("y", panel.y, is_print) +
            triangle_script(panel.triangles) + notes_script(panel.notes);
  // A panel without a point still has its axes.
  if (plots.empty()) {
    script += "set xrange [1:10]\nset yrange [1:10]\n";
    plots.emplace_back("NaN notitle");
  }
  script += "plot ";
  for (std::size_t i = 0; i < plots.size(); ++i) script += (i > 0 ? ", " : "") + plots[i];
  return script + "\n";
}

/// An empty plot below the panels that has the legend, and the caption.
std::string legend_script(const Sheet& sheet, const std::vector<Entry>& entries, const Layout& layout) {
  std::string script = fmt::format(
      "unset title\nunset xlabel\nunset ylabel\nunset border\nunset tics\nunset arrow\nunset label\nunset "
      "logscale\nunset grid\nset lmargin at screen 0\nset rmargin at screen 1\nset tmargin at screen 1\nset "
      "bmargin "
      "at screen 0\nset xrange [0:1]\nset yrange [0:1]\nset key at screen 0.5,{:.6f} center top maxcols {} "
      "horizontal Left reverse samplen 2.6 width 1\n",
      1 - layout.legend_top / layout.height, sheet.legend_columns);
  for (std::size_t i = 0; i < sheet.caption.size(); ++i) {
    script +=
        fmt::format("set label {} at screen 0.5,{:.6f} center font ',11'\n", quoted_text(sheet.caption[i]),
                    1 - (layout.caption_top + static_cast<double>(i) * line_height) / layout.height);
  }
  script += "plot ";
  for (std::size_t i = 0; i < entries.size(); ++i) {
    script += fmt::format("{}NaN {} title {}", i > 0 ? ", " : "", style_of(entries[i].look),
                          quoted_text(entries[i].title));
  }
  if (entries.empty()) script += "NaN notitle";
  return script + "\n";
}

/// Colours of dark mode, for pages and for viewers that show the file by itself.
std::string with_dark_mode(std::string svg) {
  std::string rules = "text{font-family:'DejaVu Sans',Verdana,sans-serif}@media (prefers-color-scheme:dark){";
  const auto add = [&](const render::Ink& ink) {
    const auto channel = [&](int i) {
      return std::stoi(std::string(ink.light).substr(1 + 2 * i, 2), nullptr, 16);
    };
    // gnuplot writes a colour in three ways: as it was told, with blanks, and in text without them.
    const std::string blanks = fmt::format("rgb({:3}, {:3}, {:3})", channel(0), channel(1), channel(2));
    const std::string dense = fmt::format("rgb({},{},{})", channel(0), channel(1), channel(2));
    for (const char* const what : {"stroke", "fill", "color"}) {
      rules += fmt::format("[{0}=\"{1}\"],[{0}=\"{2}\"],[{0}=\"{3}\"]{{{0}:{4}}}", what, ink.light, blanks,
                           dense, ink.dark);
    }
  };
  for (const render::Ink& ink : render::inks) add(ink);
  add(frame_ink);
  add(text_ink);
  add(paper);
  for (const char* const what : {"stroke", "fill", "color"}) {
    rules += fmt::format("[{0}=\"black\"]{{{0}:{1}}}", what, text_ink.dark);
  }
  rules += "}";
  const std::size_t place = svg.find("<defs>");
  if (place != std::string::npos) svg.insert(place, fmt::format("<style>{}</style>\n", rules));
  return svg;
}

/// Letters, of which UTF-8 has some in several bytes.
std::size_t letters_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; }));
}

/// Panels in columns of a page's width, that is `width` units.
void fit(Sheet& sheet, double width) {
  // A panel's, for its tics not to touch; somewhat less where all stand in one row then.
  constexpr double least = 290;
  constexpr double least_in_row = 240;
  const auto count = static_cast<int>(sheet.panels.size());
  const bool is_row = width / count >= least_in_row;
  sheet.columns = is_row ? count : std::clamp(static_cast<int>(width / least), 1, count);
  sheet.panel_width = width / sheet.columns;
  sheet.panel_height = std::clamp(0.64 * sheet.panel_width, 200.0, 280.0);
  sheet.left_margin = std::min(sheet.left_margin, 70.0);
  std::size_t longest = 1;
  for (const Entry& entry : legend_of(sheet)) longest = std::max(longest, letters_of(entry.title));
  sheet.legend_columns = std::max(1, static_cast<int>(width / (60 + 7.4 * static_cast<double>(longest))));
}

/// What the picture is written by. `unit`: points.
std::string terminal(const Layout& layout, PictureFormat format, const FigureStyle& style, double unit) {
  const std::string ground =
      style.transparent ? "transparent" : fmt::format("background rgb '{}'", paper.light);
  // Cairo's terminals take a font's points for those of 96 in an inch.
  const double points = style.width ? 0.75 : 0.82;
  switch (format) {
    case PictureFormat::svg:
      // Transparent is what gnuplot's SVG is by itself.
      return fmt::format("set terminal svg size {:.0f},{:.0f} font '{},12' {}\n", layout.width, layout.height,
                         style.font, style.transparent ? "" : ground);
    case PictureFormat::pdf:
      return fmt::format(
          "set terminal pdfcairo size {:.4f},{:.4f} font '{},12' fontscale {:.4g} linewidth {:.4g} "
          "pointscale {:.4g} {}\n",
          layout.width * unit / 72, layout.height * unit / 72, style.font, unit * points, unit, unit,
          style.transparent ? "transparent" : "");
    case PictureFormat::png:
      break;
  }
  const double pixels = unit * style.dpi / 72;
  return fmt::format(
      "set terminal pngcairo size {:.0f},{:.0f} font '{},12' fontscale {:.4g} linewidth {:.4g} "
      "pointscale {:.4g} {}\n",
      layout.width * pixels, layout.height * pixels, style.font, pixels * points, pixels, pixels, ground);
}

/// Its size in print, and the font that the page that shows it may lack.
std::string for_print(std::string svg, const Layout& layout, const FigureStyle& style) {
  const double unit = *style.width / layout.width;
  const std::string given = fmt::format("width=\"{:.0f}\" height=\"{:.0f}\"", layout.width, layout.height);
  const std::size_t size = svg.find(given);
  if (size != std::string::npos) {
    svg.replace(size, given.size(),
                fmt::format("width=\"{:.3f}mm\" height=\"{:.3f}mm\"", *style.width, layout.height * unit));
  }
  return svg;
}

bool begins_with_one_of(const std::string& title, const std::vector<std::string>& words) {
  return std::ranges::any_of(words, [&](const std::string& word) { return title.starts_with(word); });
}

/// Throws Error where a word begins no title.
void require_named(const std::vector<std::string>& titles, const std::vector<std::string>& words,
                   const char* what) {
  for (const std::string& word : words) {
    if (std::ranges::any_of(titles, [&](const std::string& title) { return title.starts_with(word); }))
      continue;
    throw Error(fmt::format("the figure has no {} '{}': it has {}", what, word, fmt::join(titles, "; ")));
  }
}

}  // namespace

Sheet with_choice(Sheet sheet, const std::vector<std::string>& panels,
                  const std::vector<std::string>& series) {
  std::vector<std::string> titles;
  for (const Panel& panel : sheet.panels) titles.push_back(panel.title);
  require_named(titles, panels, "panel");
  if (!panels.empty()) {
    std::erase_if(sheet.panels, [&](const Panel& panel) { return !begins_with_one_of(panel.title, panels); });
  }
  titles.clear();
  for (const Entry& entry : legend_of(sheet)) titles.push_back(entry.title);
  require_named(titles, series, "series");
  if (series.empty()) return sheet;
  for (Panel& panel : sheet.panels) {
    std::erase_if(panel.series, [&](const Series& one) { return !begins_with_one_of(one.title, series); });
  }
  return sheet;
}

Sheet with_ranges(Sheet sheet, const std::optional<std::array<double, 2>>& x,
                  const std::optional<std::array<double, 2>>& y) {
  const auto set = [](Axis& axis, const std::optional<std::array<double, 2>>& range) {
    if (!range) return;
    if (axis.logarithmic && !((*range)[0] > 0)) {
      throw Error(
          fmt::format("the range {:g}:{:g} of '{}': the axis is logarithmic, and has nothing at 0 and below",
                      (*range)[0], (*range)[1], axis.title));
    }
    axis.range = range;
  };
  for (Panel& panel : sheet.panels) {
    set(panel.x, x);
    set(panel.y, y);
  }
  return sheet;
}

std::string draw(const Sheet& given, PictureFormat format, const FigureStyle& style) {
  if (given.panels.empty()) {
    throw Error(
        fmt::format("the figure '{}' has nothing to show: the sweep measured none of it", given.title));
  }
  Sheet sheet = given;
  // Points in a unit: on screens one of the picture's, which a PNG has 96 of in an inch.
  const double unit = style.width ? style.text / 12 : format == PictureFormat::png ? 0.75 : 1;
  if (style.width) fit(sheet, *style.width / 25.4 * 72 / unit);
  const std::vector<Entry> entries = legend_of(sheet);
  constexpr double letter_width = 6.6;  // of the caption's font, on average
  const double width = layout_of(sheet, 0, style).width;
  sheet.caption.clear();
  if (style.caption) {
    // In print its lines are one paragraph.
    const std::vector<std::string> lines =
        style.width ? std::vector{fmt::format("{}", fmt::join(given.caption, " "))} : given.caption;
    sheet.caption = wrapped(lines, static_cast<int>(width / letter_width));
  }
  const Layout layout = layout_of(sheet, entries.size(), style);
  std::string script = "set encoding utf8\n" + terminal(layout, format, style, unit);
  script += fmt::format(
      "set multiplot\nset border 3 lc rgb '{0}'\nset tics out nomirror textcolor rgb '{1}'\nset mxtics "
      "1\nset mytics "
      "1\nset grid xtics ytics lc rgb '{0}' lw 0.5 dt 3\nunset key\n",
      frame_ink.light, text_ink.light);
  for (std::size_t i = 0; i < layout.title.size(); ++i) {
    script +=
        fmt::format("set label {} at screen 0.5,{:.6f} center font ',{:g}' textcolor rgb '{}'\n",
                    quoted_text(layout.title[i]), 1 - (18 + 18 * static_cast<double>(i)) / layout.height,
                    layout.title_size, text_ink.light);
  }
  // The title is a label of a plot that shows nothing else, since each panel clears its labels.
  script += "unset border\nunset tics\nset xrange [0:1]\nset yrange [0:1]\nplot NaN notitle\n";
  script += fmt::format("unset label\nset border 3 lc rgb '{0}'\nset tics out nomirror textcolor rgb '{1}'\n",
                        frame_ink.light, text_ink.light);
  for (std::size_t i = 0; i < sheet.panels.size(); ++i)
    script += panel_script(sheet, i, layout, style.width.has_value());
  script += legend_script(sheet, entries, layout);
  script += "unset multiplot\n";
  const std::string picture = gnuplot(script);
  if (format != PictureFormat::svg) return picture;
  if (style.width) return for_print(picture, layout, style);
  return style.transparent ? picture : with_dark_mode(picture);
}

}  // namespace substep::report
