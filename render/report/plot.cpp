#include "render/report/plot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <system_error>

#include "render/inks.h"
#include "render/report/plot_layout.h"
#include "sim/error.h"
#include "sim/execution/child_process.h"

namespace substep::report {
namespace {

constexpr render::Ink text_ink{"#222222", "#e6e6e6"};
constexpr render::Ink frame_ink{"#b8b8b8", "#5a5a5a"};
constexpr render::Ink paper{"#ffffff", "#14171a"};

/// Returns gnuplot's options for a style.
std::string style_script(const SeriesStyle& style) {
  const char* const color = render::inks.at(static_cast<std::size_t>(style.hue)).light;
  const std::string line = fmt::format("lc rgb '{}' lw 1.8 dt {}", color, style.dashed ? 2 : 1);
  const std::string points = fmt::format("pt {} ps {:g}", style.shape, 0.75 * style.size);
  if (!style.line) return fmt::format("with points {} lc rgb '{}'", points, color);
  if (!style.points) return fmt::format("with lines {}", line);
  return fmt::format("with linespoints {} {}", line, points);
}

/// Returns text in gnuplot's single quotes, with underscores that make no subscripts.
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

/// Returns the smallest and largest drawn coordinate of a panel along an axis, 0 for x.
std::array<double, 2> range_of(const Panel& panel, std::size_t axis) {
  std::array<double, 2> range{INFINITY, -INFINITY};
  for (const Series& series : panel.series) {
    for (const auto& point : series.points) {
      if (!can_be_drawn(point, panel)) continue;
      range = {std::min(range[0], point[axis]), std::max(range[1], point[axis])};
    }
  }
  return range;
}

/// Returns the commands for one axis. `length`: of the axis; `room`: of a tic's label along the axis.
std::string axis_script(char name, const Axis& axis, const std::array<double, 2>& data, double length,
                        double room) {
  std::string tics = axis.tics;
  const char* format = "%g";
  const auto& [low, high] = axis.range.value_or(data);
  if (axis.logarithmic && axis.range && std::floor(std::log10(high)) <= std::ceil(std::log10(low))) {
    // Name the ends of a range that holds fewer than two powers of ten.
    if (tics.empty()) tics = fmt::format("({:g}, {:g})", low, high);
  } else if (axis.logarithmic && tics.empty()) {
    const double below = std::floor(std::log10(low));
    const double decades = low < high ? std::ceil(std::log10(high)) - below : 1;
    const double step = std::max(1.0, std::ceil(decades * room / length));
    // Begin at a power of ten: gnuplot begins at a multiple of the step, such as 200.
    if (axis.range) tics = fmt::format("1e{:.0f},", step * std::floor(below / step));
    tics += fmt::format("1e{:.0f}", step);
    format = "10^{%T}";
  }
  std::string script = fmt::format("{1} logscale {0}\nset autoscale {0}\nset format {0} '{2}'\n", name,
                                   axis.logarithmic ? "set" : "unset", format);
  if (axis.range)
    script += fmt::format("set {}range [{:g}:{:g}]\n", name, (*axis.range)[0], (*axis.range)[1]);
  if (!tics.empty()) script += fmt::format("set {}tics {}\n", name, tics);
  return script;
}

std::string triangle_script(const std::array<double, 2>& corner) {
  constexpr double width = 3;
  const auto& [x, y] = corner;
  std::string script;
  const auto line = [&](double x0, double y0, double x1, double y1) {
    script += fmt::format("set arrow from {:g},{:g} to {:g},{:g} nohead lc rgb '{}' lw 1.2 front\n", x0, y0,
                          x1, y1, render::inks[7].light);
  };
  line(x, y, width * x, y);
  line(width * x, y, width * x, width * y);
  line(x, y, width * x, width * y);
  return script + fmt::format("set label '1' at {:g},{:g} left offset 0.4,0 tc rgb '{}' front\n", width * x,
                              std::sqrt(width) * y, render::inks[7].light);
}

std::string notes_script(const std::vector<Note>& notes) {
  std::string script;
  for (const Note& note : notes) {
    script += fmt::format("set label {} at {:g},{:g} right offset -0.9,{} font ',11' tc rgb '{}' front\n",
                          quoted_text(note.text), note.x, note.y, note.is_below ? -0.9 : 0, text_ink.light);
  }
  return script;
}

/// Returns a label at a point, measured from the picture's top left corner.
std::string text_script(const Layout& layout, const std::string& text, double x, double y,
                        const char* placement, double size) {
  return fmt::format("set label {} at screen {:.6f},{:.6f} {} font ',{:g}' textcolor rgb '{}'\n",
                     quoted_text(text), x / layout.width, 1 - y / layout.height, placement, size,
                     text_ink.light);
}

std::string panel_script(const Sheet& sheet, std::size_t index, const Layout& layout) {
  const Panel& panel = sheet.panels[index];
  const double left = layout.left(index);
  const double right = layout.right(index);
  const double top = layout.top(index);
  const double bottom = layout.bottom(index);
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
    if (count > 0) plots.push_back(fmt::format("$data{} {} notitle", i, style_script(panel.series[i].style)));
  }
  script += fmt::format(
      "set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\nset tmargin at screen {:.6f}\nset bmargin "
      "at screen {:.6f}\n",
      left / layout.width, right / layout.width, 1 - top / layout.height, 1 - bottom / layout.height);
  script += "set xtics out nomirror scale 0.5 autofreq\nset ytics out nomirror scale 0.5 autofreq\n";
  script += axis_script('x', panel.x, range_of(panel, 0), right - left, 40) +
            axis_script('y', panel.y, range_of(panel, 1), bottom - top, 18) + "unset arrow\nunset label\n" +
            (panel.triangle ? triangle_script(*panel.triangle) : "") + notes_script(panel.notes);
  script += text_script(layout, panel.title, 0.5 * (left + right), top - 12, "center", 12) +
            text_script(layout, panel.x.title, 0.5 * (left + right), bottom + 35, "center", 12) +
            text_script(layout, panel.y.title, left - layout.left_margin + 12, 0.5 * (top + bottom),
                        "center rotate by 90", 12);
  // Draw the axes of a panel without points.
  if (plots.empty()) {
    script += "set xrange [1:10]\nset yrange [1:10]\n";
    plots.emplace_back("NaN notitle");
  }
  return fmt::format("{}plot {}\n", script, fmt::join(plots, ", "));
}

/// Returns an empty plot over the whole picture that holds title, legend and caption.
std::string words_script(const Layout& layout) {
  std::string script =
      "unset border\nunset tics\nunset arrow\nunset label\nunset logscale\nunset grid\nset lmargin at screen "
      "0\nset rmargin at screen 1\nset tmargin at screen 1\nset bmargin at screen 0\n";
  script += fmt::format("set xrange [0:{:.6f}]\nset yrange [{:.6f}:0]\n", layout.width, layout.height);
  std::vector<std::string> plots;
  for (std::size_t i = 0; i < layout.legend.size(); ++i) {
    const LegendEntry& entry = layout.legend[i];
    script += fmt::format("$sample{} << END\n", i);
    for (const double x : {0.0, 0.5 * sample_width, sample_width}) {
      // Draw a line with its point in the middle, or the point alone.
      if (entry.style.line || x == 0.5 * sample_width)
        script += fmt::format("{:.3f} {:.3f} {}\n", entry.x + x, entry.y, x == 0.5 * sample_width ? 0.75 : 0);
    }
    script += "END\n";
    SeriesStyle line = entry.style;
    line.points = false;
    SeriesStyle point = entry.style;
    point.line = false;
    if (entry.style.line)
      plots.push_back(fmt::format("$sample{} using 1:2 {} notitle", i, style_script(line)));
    if (entry.style.points || !entry.style.line) {
      plots.push_back(
          fmt::format("$sample{} using 1:($3 > 0 ? $2 : NaN) {} notitle", i, style_script(point)));
    }
    for (std::size_t k = 0; k < entry.lines.size(); ++k) {
      script += text_script(layout, entry.lines[k], entry.x + sample_width + sample_gap,
                            entry.y + static_cast<double>(k) * line_height, "left", 12);
    }
  }
  for (std::size_t i = 0; i < layout.title.size(); ++i)
    script += text_script(layout, layout.title[i], 0.5 * layout.width, 18 + 18 * static_cast<double>(i),
                          "center", layout.title_size);
  for (std::size_t i = 0; i < layout.caption.size(); ++i)
    script += text_script(layout, layout.caption[i], 0.5 * layout.width,
                          layout.caption_top + static_cast<double>(i) * line_height, "center", caption_size);
  if (plots.empty()) plots.emplace_back("NaN notitle");
  return fmt::format("{}plot {}\n", script, fmt::join(plots, ", "));
}

/// Adds the font and the colours of dark mode to an SVG.
std::string with_dark_mode(std::string svg, const std::string& font) {
  std::string rules =
      fmt::format("text{{font-family:'{}',Verdana,sans-serif}}@media (prefers-color-scheme:dark){{", font);
  const auto add = [&](const render::Ink& ink) {
    const auto channel = [&](int i) {
      return std::stoi(std::string(ink.light).substr(1 + 2 * i, 2), nullptr, 16);
    };
    // gnuplot writes a colour in three ways: as given, with blanks, and in text without blanks.
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
  for (const char* const what : {"stroke", "fill", "color"})
    rules += fmt::format("[{0}=\"black\"]{{{0}:{1}}}", what, text_ink.dark);
  rules += "}";
  const std::size_t place = svg.find("<defs>");
  if (place != std::string::npos) svg.insert(place, fmt::format("<style>{}</style>\n", rules));
  return svg;
}

/// Returns the terminal command that writes the picture. `unit`: points.
std::string terminal(const Layout& layout, PictureFormat format, const FigureStyle& style, double unit) {
  const std::string ground =
      style.transparent ? "transparent" : fmt::format("background rgb '{}'", paper.light);
  // Cairo's terminals assume 96 points in an inch, and so does the layout's measurement of text.
  constexpr double points = 0.75;
  if (format == PictureFormat::svg) {
    // gnuplot's SVG is transparent by default.
    return fmt::format("set terminal svg size {:.0f},{:.0f} font '{},12' {}\n", layout.width, layout.height,
                       style.font, style.transparent ? "" : ground);
  }
  const bool is_pdf = format == PictureFormat::pdf;
  const double scale = is_pdf ? unit : unit * style.dpi / 72;
  // The size is in inches in a PDF, whose ground is white by default, and in pixels in a PNG
  const std::string size =
      is_pdf ? fmt::format("{:.4f},{:.4f}", layout.width * unit / 72, layout.height * unit / 72)
             : fmt::format("{:.0f},{:.0f}", layout.width * scale, layout.height * scale);
  return fmt::format(
      "set terminal {}cairo size {} font '{},12' fontscale {:.4g} linewidth {:.4g} dashlength 0.5 pointscale "
      "{:.4g} {}\n",
      is_pdf ? "pdf" : "png", size, style.font, scale * points, scale, scale,
      is_pdf && !style.transparent ? "" : ground);
}

/// Gives an SVG its size in print.
std::string for_print(std::string svg, const Layout& layout, const FigureStyle& style) {
  const double unit = *style.width / layout.width;
  const std::string given = fmt::format("width=\"{:.0f}\" height=\"{:.0f}\"", layout.width, layout.height);
  const std::size_t size = svg.find(given);
  if (size != std::string::npos)
    svg.replace(size, given.size(),
                fmt::format("width=\"{:.3f}mm\" height=\"{:.3f}mm\"", *style.width, layout.height * unit));
  return svg;
}

/// Returns what gnuplot prints for a script. Throws Error where gnuplot is missing or fails.
std::string gnuplot(const std::string& script) {
  const TemporaryFile in(script);
  const TemporaryFile out;
  const TemporaryFile messages;
  bool succeeds = false;
  try {
    succeeds =
        ChildProcess({"gnuplot"}, {in.descriptor(), out.descriptor(), messages.descriptor()}).succeeds();
  } catch (const std::system_error& error) {
    throw Error(
        "the program gnuplot, which draws figures, cannot be started ({}): on Debian, apt-get "
        "install gnuplot-nox",
        error.code().message());
  }
  std::string text = out.content();
  if (!succeeds || text.empty()) throw Error("gnuplot failed: {}", messages.content());
  return text;
}

bool begins_with_one_of(const std::string& title, const std::vector<std::string>& words) {
  return std::ranges::any_of(words, [&](const std::string& word) { return title.starts_with(word); });
}

/// Throws Error where one of the words begins no title.
void require_named(const std::vector<std::string>& titles, const std::vector<std::string>& words,
                   const char* what) {
  for (const std::string& word : words) {
    if (std::ranges::none_of(titles, [&](const std::string& title) { return title.starts_with(word); }))
      throw Error("the figure has no {} '{}': it has {}", what, word, fmt::join(titles, "; "));
  }
}

}  // namespace

SeriesStyle style_of(Algorithm algorithm) {
  constexpr std::array shapes{7, 5, 9, 13, 11, 3, 1};
  return {render::hue_of(algorithm), shapes.at(static_cast<std::size_t>(algorithm))};
}

void separate_styles(Sheet& sheet) {
  constexpr int shapes = 13;
  std::map<std::string, SeriesStyle> styles;  // by title
  for (Panel& panel : sheet.panels) {
    for (Series& series : panel.series) {
      const auto [entry, is_new] = styles.try_emplace(series.title, series.style);
      const auto looks_alike = [&](const auto& other) {
        return other.first != series.title && other.second == series.style;
      };
      for (int tried = 0; is_new && tried < shapes && std::ranges::any_of(styles, looks_alike); ++tried)
        series.style.shape = series.style.shape % shapes + 1;
      if (is_new) entry->second = series.style;
      series.style = entry->second;
    }
  }
}

bool can_be_drawn(const std::array<double, 2>& point, const Panel& panel) {
  return std::isfinite(point[0]) && std::isfinite(point[1]) && (!panel.x.logarithmic || point[0] > 0) &&
         (!panel.y.logarithmic || point[1] > 0);
}

std::string caption_text(const Sheet& sheet) {
  std::string text = sheet.title + "\n\n";
  for (const std::string& line : sheet.caption) text += line + "\n";
  if (!sheet.left_out.empty()) text += "\nLeft out:\n";
  for (const LeftOut& one : sheet.left_out)
    text += fmt::format("- {} of {}: {}\n", one.series, one.scene, one.reason);
  return text;
}

Sheet with_choice(Sheet sheet, const std::vector<std::string>& panels,
                  const std::vector<std::string>& series) {
  std::vector<std::string> titles;
  for (const Panel& panel : sheet.panels) titles.push_back(panel.title);
  require_named(titles, panels, "panel");
  if (!panels.empty())
    std::erase_if(sheet.panels, [&](const Panel& panel) { return !begins_with_one_of(panel.title, panels); });
  titles.clear();
  for (const auto& [title, style] : series_titles(sheet)) titles.push_back(title);
  require_named(titles, series, "series");
  if (series.empty()) return sheet;
  for (Panel& panel : sheet.panels) {
    std::erase_if(panel.series, [&](const Series& one) { return !begins_with_one_of(one.title, series); });
    std::erase_if(panel.notes, [&](const Note& note) {
      const std::array at{note.x, note.y};
      return std::ranges::none_of(panel.series, [&](const Series& one) {
        return std::ranges::find(one.points, at) != one.points.end();
      });
    });
  }
  return sheet;
}

Sheet with_ranges(Sheet sheet, const std::optional<std::array<double, 2>>& x,
                  const std::optional<std::array<double, 2>>& y) {
  const auto set = [](Axis& axis, const std::optional<std::array<double, 2>>& range) {
    if (!range) return;
    if (axis.logarithmic && !((*range)[0] > 0)) {
      throw Error("the range {:g}:{:g} of '{}': the axis is logarithmic, and has nothing at 0 and below",
                  (*range)[0], (*range)[1], axis.title);
    }
    axis.range = range;
  };
  for (Panel& panel : sheet.panels) {
    set(panel.x, x);
    set(panel.y, y);
    const auto is_shown = [&](const std::array<double, 2>& point) {
      return can_be_drawn(point, panel) && panel.x.holds(point[0]) && panel.y.holds(point[1]);
    };
    const auto has_shown = [&](const Series& one) { return std::ranges::any_of(one.points, is_shown); };
    if ((x || y) && std::ranges::none_of(panel.series, has_shown))
      throw Error("no point of the panel '{}' lies in the range", panel.title);
  }
  return sheet;
}

std::string draw(const Sheet& sheet, PictureFormat format, const FigureStyle& style) {
  if (sheet.panels.empty())
    throw Error("the figure '{}' has nothing to show: the sweep measured none of it", sheet.title);
  // Points in a unit of the picture; a PNG has 96 units in an inch.
  const double unit = style.width ? style.text / 12 : format == PictureFormat::png ? 0.75 : 1;
  const Layout layout = layout_of(sheet, style, style.width ? *style.width / 25.4 * 72 / unit : 0);
  std::string script = "set encoding utf8\n" + terminal(layout, format, style, unit);
  script += fmt::format(
      "set multiplot\nset border 3 lc rgb '{0}'\nset tics out nomirror textcolor rgb '{1}'\nset mxtics "
      "1\nset mytics 1\nset grid xtics ytics lc rgb '{0}' lw 0.5 dt 3\nunset key\n",
      frame_ink.light, text_ink.light);
  for (std::size_t i = 0; i < sheet.panels.size(); ++i) script += panel_script(sheet, i, layout);
  script += words_script(layout) + "unset multiplot\n";
  const std::string picture = gnuplot(script);
  if (format != PictureFormat::svg) return picture;
  if (style.width) return for_print(picture, layout, style);
  return style.transparent ? picture : with_dark_mode(picture, style.font);
}

}  // namespace substep::report
