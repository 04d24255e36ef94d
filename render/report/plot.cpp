#include "render/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/inks.h"
#include "render/report/gnuplot.h"
#include "sim/error.h"

namespace substep {
namespace {

constexpr Ink text_ink{"#222222", "#e6e6e6"};
constexpr Ink frame_ink{"#b8b8b8", "#5a5a5a"};
constexpr Ink paper{"#ffffff", "#14171a"};

constexpr double title_height = 44;
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
      fmt::format("lc rgb '{}' lw 1.8 dt {}", inks.at(look.hue).light, look.dashed ? 2 : 1);
  const std::string points = fmt::format("pt {} ps 0.75", look.shape);
  if (!look.line) return fmt::format("with points {} lc rgb '{}'", points, inks.at(look.hue).light);
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

std::string axis_script(const char* name, const Axis& axis) {
  std::string script = fmt::format("set {0}label {1} offset {3}\n{2} logscale {0}\nset autoscale {0}\n", name,
                                   quoted_text(axis.title), axis.logarithmic ? "set" : "unset",
                                   name[0] == 'x' ? "0,0.7" : "1.2,0");
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
                            x1, y1, inks[7].light);
    };
    line(t.x, t.y, x, t.y);
    line(x, t.y, x, y);
    line(t.x, t.y, x, y);
    script += fmt::format("set label '{:g}' at {:g},{:g} left offset 0.4,0 tc rgb '{}' front\n", t.slope, x,
                          t.y * std::pow(t.width, t.slope / 2), inks[7].light);
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

struct Layout {
  double width;
  double height;
  double legend_top;   ///< y of the legend's top edge, from the top
  double caption_top;  ///< y of the caption's first line's middle
};

Layout layout_of(const Sheet& sheet, std::size_t entries) {
  const int columns = std::min<int>(sheet.columns, static_cast<int>(sheet.panels.size()));
  const int rows = (static_cast<int>(sheet.panels.size()) + columns - 1) / columns;
  const int legend_rows = (static_cast<int>(entries) + sheet.legend_columns - 1) / sheet.legend_columns;
  Layout layout{};
  layout.width = columns * sheet.panel_width;
  layout.legend_top = title_height + rows * sheet.panel_height + 12;
  layout.caption_top = layout.legend_top + legend_rows * (line_height + 2) + 20;
  layout.height = layout.caption_top + static_cast<double>(sheet.caption.size()) * line_height + 2;
  return layout;
}

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

std::string panel_script(const Sheet& sheet, std::size_t index, const Layout& layout) {
  const Panel& panel = sheet.panels[index];
  const auto column = static_cast<double>(index % sheet.columns);
  const auto row = static_cast<double>(index / sheet.columns);
  const double left = column * sheet.panel_width + sheet.left_margin;
  const double top = title_height + row * sheet.panel_height + top_margin;
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
  script += axis_script("x", panel.x) + axis_script("y", panel.y) + triangle_script(panel.triangles) +
            notes_script(panel.notes);
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
  const auto add = [&](const Ink& ink) {
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
  for (const Ink& ink : inks) add(ink);
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

}  // namespace

std::string draw(const Sheet& given, PictureFormat format) {
  if (given.panels.empty()) {
    throw Error(
        fmt::format("the figure '{}' has nothing to show: the sweep measured none of it", given.title));
  }
  Sheet sheet = given;
  constexpr double letter_width = 6.6;  // of the caption's font, on average
  sheet.caption = wrapped(given.caption, static_cast<int>(layout_of(given, 0).width / letter_width));
  const std::vector<Entry> entries = legend_of(sheet);
  const Layout layout = layout_of(sheet, entries.size());
  std::string script = "set encoding utf8\n";
  if (format == PictureFormat::svg) {
    script += fmt::format("set terminal svg size {:.0f},{:.0f} font 'DejaVu Sans,12' background rgb '{}'\n",
                          layout.width, layout.height, paper.light);
  } else {
    // A pixel as a point.
    script += fmt::format("set terminal pdfcairo size {:.4f},{:.4f} font 'DejaVu Sans,12' fontscale 0.82\n",
                          layout.width / 72, layout.height / 72);
  }
  script += fmt::format(
      "set multiplot\nset border 3 lc rgb '{0}'\nset tics out nomirror textcolor rgb '{1}'\nset mxtics "
      "1\nset mytics "
      "1\nset grid xtics ytics lc rgb '{0}' lw 0.5 dt 3\nunset key\nset label {2} at screen 0.5,{3:.6f} "
      "center font "
      "',15' textcolor rgb '{1}'\n",
      frame_ink.light, text_ink.light, quoted_text(sheet.title), 1 - 18 / layout.height);
  // The title is a label of a plot that shows nothing else, since each panel clears its labels.
  script += "unset border\nunset tics\nset xrange [0:1]\nset yrange [0:1]\nplot NaN notitle\n";
  script += fmt::format("unset label\nset border 3 lc rgb '{0}'\nset tics out nomirror textcolor rgb '{1}'\n",
                        frame_ink.light, text_ink.light);
  for (std::size_t i = 0; i < sheet.panels.size(); ++i) script += panel_script(sheet, i, layout);
  script += legend_script(sheet, entries, layout);
  script += "unset multiplot\n";
  const std::string picture = gnuplot(script);
  return format == PictureFormat::svg ? with_dark_mode(picture) : picture;
}

}  // namespace substep
