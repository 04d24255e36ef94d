#include "render/video/composition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string_view>

#include "render/inks.h"
#include "render/text.h"
#include "sim/error.h"

namespace substep::render {
namespace {

constexpr Color ground{15, 18, 24};
constexpr Color surface{24, 29, 37};
constexpr Color grid{52, 60, 72};
constexpr Color bright{236, 240, 245};
constexpr Color quiet{146, 156, 170};
constexpr Color alarm{255, 92, 105};

/// "#5db4ea".
Color color_in(const char* ink) {
  Color color{};
  for (std::size_t i = 0; i < color.size(); ++i) {
    const auto digit = [&](std::size_t at) { return ink[at] <= '9' ? ink[at] - '0' : ink[at] - 'a' + 10; };
    color[i] = static_cast<std::uint8_t>(16 * digit(1 + 2 * i) + digit(2 + 2 * i));
  }
  return color;
}

/// Returns `percent` of `color` over the rest of `below`.
Color mixed(const Color& color, const Color& below, int percent) {
  Color result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = static_cast<std::uint8_t>(below[i] + (color[i] - below[i]) * percent / 100);
  }
  return result;
}

/// `color` faded into the strip's ground. Not by drawing with an alpha: where a curve's pieces meet, that
/// would show as beads.
Color faded(const Color& color) {
  return mixed(color, surface, 38);
}

/// Returns a shade of an ink: itself, then nearer to `away`, then fainter, and again.
Color shaded(const char* ink, int shade, const Color& away) {
  constexpr Color grey{100, 104, 112};
  const Color color = color_in(ink);
  return shade % 3 == 0 ? color : shade % 3 == 1 ? mixed(color, away, 45) : mixed(color, grey, 50);
}

/// The baseline that centres capitals and digits of this size in a box.
double baseline(double y, double height, double size) {
  return y + height / 2 + 0.31 * size;
}

/// Breaks text at spaces into lines of at most a width.
std::vector<std::string> wrapped(const std::string& text, const TextStyle& style, double width) {
  std::vector<std::string> lines{""};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::string longer = lines.back() + (lines.back().empty() ? "" : " ") + word;
    if (lines.back().empty() || text_width(longer, style) <= width) {
      lines.back() = longer;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

/// Cuts text to a width, with an ellipsis where it was longer.
std::string cut(const std::string& text, const TextStyle& style, double width) {
  if (text_width(text, style) <= width) return text;
  std::string shorter = text;
  while (!shorter.empty() && text_width(shorter + "…", style) > width) {
    // A character of several bytes goes as a whole.
    while (!shorter.empty() && (static_cast<unsigned char>(shorter.back()) & 0xC0) == 0x80)
      shorter.pop_back();
    if (!shorter.empty()) shorter.pop_back();
  }
  return shorter + "…";
}

}  // namespace

std::string film_title(const Scene& scene, const std::string& given) {
  if (!given.empty()) return given;
  std::string title = scene.name;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
}

Dash dash_of(std::size_t run) {
  constexpr std::array<Dash, 5> dashes{{{1, 0}, {14, 3}, {9, 6}, {5, 8}, {2.5, 9}}};
  return dashes[run % dashes.size()];
}

Color accent(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).dark, panel.shade, {255, 255, 255});
}

Color accent_on_white(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).light, panel.shade, {0, 0, 0});
}

std::string html_color(const Color& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

std::vector<int> rows_for(int count, int width, int height, int above) {
  constexpr double usual = 16.0 / 9;
  std::vector<int> best{count};
  double largest = -1;
  for (int rows = 1; rows <= count; ++rows) {
    const int least = count / rows;
    const int most = least + (count % rows > 0 ? 1 : 0);
    const double wide = static_cast<double>(width) / most;
    const double high = static_cast<double>(height) / rows - above;
    // The view shows somewhat more than a picture of the usual shape, were there more room; less
    // where panels of two widths are hard to compare.
    const double seen = (std::min(wide, high * usual) + 0.1 * std::min(wide, 2 * high * usual)) *
                        (1 - 0.15 * (static_cast<double>(most) / least - 1));
    if (high <= 0 || seen <= largest * (1 + 1e-9)) continue;
    largest = seen;
    best.assign(static_cast<std::size_t>(rows), least);
    std::fill_n(best.begin(), count % rows, most);
  }
  return best;
}

void check_film_size(int width, int height) {
  if (width < 180 || height < 180 || width > 7680 || height > 7680 || width % 2 != 0 || height % 2 != 0 ||
      static_cast<std::int64_t>(width) * height > std::int64_t{7680} * 4320) {
    throw Error(
        fmt::format("size {}x{}: a video's must be even, at least 180 each way and at most 7680x4320 in all",
                    width, height));
  }
}

Composition::Composition(const Comparison& comparison, const std::string& title, int width, int height,
                         const std::vector<KeyEntry>& key, const std::vector<Strip>& strips)
    : comparison_(comparison),
      titles_(titles_of(comparison.runs)),
      width_(width),
      height_(height),
      scale_(std::sqrt(static_cast<double>(width) * height / (1280.0 * 720))),
      strips_(strips) {
  check_film_size(width, height);
  if (strips_.empty() && comparison.strip) strips_.push_back(*comparison.strip);
  if (!comparison.reference) std::erase(strips_, Strip::error);
  if (!key.empty()) footer_ = static_cast<int>(std::lround(std::max(14.0, 26 * scale_)));
  lay_out();
  draw_background(title);
  if (!key.empty()) draw_footer(key);
}

double Composition::text_size(double at_720) const {
  return std::max(10.0, at_720 * scale_);
}

void Composition::lay_out() {
  const auto scaled = [this](double at_720, double least) {
    return static_cast<int>(std::lround(std::max(least, at_720 * scale_)));
  };
  const int gap = scaled(12, 4);
  title_ = {gap, 0, width_ - 2 * gap, scaled(40, 18)};
  const int top =
      title_.height +
      static_cast<int>(1.3 * legend_style().size * static_cast<double>(legend_lines().size()) + 4 * scale_);
  const int header = scaled(36, 16);
  const int strip = scaled(62, 28);
  const int strips = strip * static_cast<int>(strips_.size());
  const int count = static_cast<int>(comparison_.runs.size());
  const std::vector<int> rows = rows_for(count, width_ - gap, height_ - top - footer_, header + strips + gap);
  const auto row_count = static_cast<int>(rows.size());
  const auto width_in = [&](int columns) { return (width_ - (columns + 1) * gap) / columns; };
  const int panel_height = (height_ - top - footer_ - row_count * gap) / row_count;
  const int narrowest = width_in(rows.front());
  picture_height_ = panel_height - header - strips;
  if (narrowest < 40 || picture_height_ < 24) {
    throw Error(
        fmt::format("size {}x{}: leaves no room for {} panels: make it larger", width_, height_, count));
  }
  // In a narrow panel the axis' names would take the curve's room.
  has_axis_ = narrowest > 4 * text_width("0.1 mm", {.size = text_size(14)});
  int y = top;
  for (const int columns : rows) {
    for (int column = 0; column < columns; ++column) {
      const int x = gap + column * (width_in(columns) + gap);
      Panel panel;
      panel.header = {x, y, width_in(columns), header};
      panel.picture = {x, y + header, width_in(columns), picture_height_};
      lay_out_strips(panel, x, y + header + picture_height_, width_in(columns), strip);
      panels_.push_back(panel);
    }
    y += panel_height + gap;
  }
}

void Composition::lay_out_strips(Panel& panel, int x, int y, int width, int height) const {
  const auto scaled = [this](double at_720, double least) {
    return static_cast<int>(std::lround(std::max(least, at_720 * scale_)));
  };
  // Room for the axis at the left and for the value at the right.
  const int axis = static_cast<int>(text_width("0.1 mm", {.size = text_size(14)}) + 8 * scale_);
  const int left = has_axis_ ? axis : scaled(6, 4);
  const int right = std::clamp(static_cast<int>(0.33 * width), 52, scaled(126, 60));
  const int margin = scaled(8, 4);
  for (const Strip kind : strips_) {
    StripBox box{kind, axis_of(comparison_, kind)};
    box.strip = {x, y, width, height};
    box.plot = {x + left, y + margin, std::max(8, width - left - right), std::max(0, height - 2 * margin)};
    panel.strips.push_back(box);
    y += height;
  }
}

double Composition::plot_x(const StripBox& strip, std::size_t k) const {
  const std::size_t last = std::max<std::size_t>(1, comparison_.times.size() - 1);
  return strip.plot.x + static_cast<double>(k) / static_cast<double>(last) * strip.plot.width;
}

double Composition::plot_y(const StripBox& strip, double value) const {
  return strip.plot.y + strip.plot.height * (1 - std::max(0.0, strip.axis.height(value)));
}

std::string Composition::legend() const {
  std::string text;
  for (const Strip strip : strips_) text += (text.empty() ? "strips: " : "; ") + words_of(comparison_, strip);
  return text;
}

void Composition::draw_title(const std::string& title) {
  TextStyle bold{.size = text_size(24), .color = bright, .bold = true};
  const TextStyle clock{.size = text_size(22), .bold = true};
  const double room = title_.width - text_width("00.00 s", clock) - 16 * scale_;
  while (bold.size > 8 && text_width(title, bold) > room) bold.size *= 0.95;
  draw_text(background_, title_.x, baseline(title_.y, title_.height, bold.size), title, bold);
  const std::vector<std::string> lines = legend_lines();
  double middle = title_.y + title_.height + 0.5 * legend_style().size;
  for (const std::string& line : lines) {
    draw_text(background_, title_.x, baseline(middle, 0, legend_style().size), line, legend_style());
    middle += 1.3 * legend_style().size;
  }
}

TextStyle Composition::legend_style() const {
  return {.size = text_size(17), .color = quiet};
}

/// Returns what all panels share, then what the strips show.
std::vector<std::string> Composition::legend_lines() const {
  std::string text = titles_.shared;
  if (!strips_.empty()) text += (text.empty() ? "" : " · ") + legend();
  return text.empty() ? std::vector<std::string>{} : wrapped(text, legend_style(), title_.width);
}

void Composition::draw_background(const std::string& title) {
  background_ = Image(width_, height_);
  fill_rectangle(background_, 0, 0, width_, height_, ground);
  draw_title(title);
  const double factor = header_factor();
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    const Panel& panel = panels_[run];
    draw_header(panel, run, factor);
    for (const StripBox& strip : panel.strips) {
      const Box& box = strip.strip;
      fill_rectangle(background_, box.x, box.y, box.width, box.height, surface);
      draw_grid(strip);
      if (strip.kind == Strip::error) draw_certainty(strip);
      if (comparison_.runs[run].is_reference() && &strip == &panel.strips.front()) draw_key(strip);
    }
  }
}

/// As large as fits.
void Composition::draw_footer(const std::vector<KeyEntry>& key) {
  TextStyle style{.size = text_size(15)};
  const auto width = [&] {
    double sum = 0;
    for (const auto& [text, color] : key) sum += text_width(text, style);
    return sum;
  };
  while (style.size > 6 && width() > title_.width) style.size *= 0.97;
  double x = title_.x;
  for (const auto& [text, color] : key) {
    style.color = color;
    draw_text(background_, x, baseline(height_ - footer_, footer_, style.size) - 2 * scale_, text, style);
    x += text_width(text, style);
  }
}

double Composition::header_width(std::size_t run, double factor) const {
  const std::string& words = titles_.words[run];
  const double name =
      text_width(name_of(comparison_.runs[run].panel), {.size = factor * text_size(24), .bold = true});
  return 28 * scale_ + name + (words.empty() ? 0 : text_width(words, {.size = factor * text_size(22)}));
}

/// Returns by how much all headers shrink, so that the longest fits or is as small as can be read.
double Composition::header_factor() const {
  double factor = 1;
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    const auto fits = [&] { return header_width(run, factor) <= panels_[run].header.width; };
    while (!fits() && factor * text_size(22) > 9) factor *= 0.97;
  }
  return factor;
}

void Composition::draw_header(const Panel& panel, std::size_t run, double factor) {
  const Box& box = panel.header;
  const Color color = accent(comparison_.runs[run].panel);
  fill_rectangle(background_, box.x, box.y, box.width, box.height, surface);
  const int bar = std::max(2, static_cast<int>(std::lround(4 * scale_)));
  fill_rectangle(background_, box.x, box.y, bar, box.height, color);
  const TextStyle bold{.size = factor * text_size(24), .color = color, .bold = true};
  const TextStyle plain{.size = factor * text_size(22), .color = bright};
  double x = box.x + bar + 8 * scale_;
  const std::string name = name_of(comparison_.runs[run].panel);
  draw_text(background_, x, baseline(box.y, box.height, bold.size), name, bold);
  x += text_width(name, bold) + 10 * scale_;
  draw_text(background_, x, baseline(box.y, box.height, bold.size),
            cut(titles_.words[run], plain, box.x + box.width - x), plain);
}

void Composition::draw_grid(const StripBox& strip) {
  const Box& plot = strip.plot;
  const TextStyle style{.size = text_size(14), .color = quiet};
  const auto draw_label = [&](const std::string& text, double y, double offset) {
    if (!has_axis_) return;
    draw_text(background_, plot.x - 5 * scale_ - text_width(text, style), y + 0.31 * style.size + offset,
              text, style);
  };
  if (!strip.axis.is_logarithmic) {
    for (const double value : {strip.axis.low, strip.axis.high, strip.axis.mark}) {
      const double y = plot_y(strip, value);
      const bool is_mark = value == strip.axis.mark;
      draw_line(background_, plot.x, y, plot.x + plot.width, y, 1, is_mark ? quiet : grid);
      // Where the mark is near an end, it alone is named: that is what the curve is read against.
      const double room = std::abs(y - plot_y(strip, strip.axis.mark));
      if (is_mark || room > style.size) draw_label(strip.axis.label(value), y, 0);
    }
  } else {
    const int lower = strip.axis.decades.lower;
    const int decades = strip.axis.decades.upper - lower;
    for (int decade = 0; decade <= decades; ++decade) {
      const double y = plot.y + plot.height * (1 - static_cast<double>(decade) / decades);
      draw_line(background_, plot.x, y, plot.x + plot.width, y, 1, grid);
      // The top and the bottom: between them there is no room for more.
      if (decade != 0 && decade != decades) continue;
      constexpr std::array<const char*, 10> names{"1 µm",  "10 µm", "0.1 mm", "1 mm",  "1 cm",
                                                  "10 cm", "1 m",   "10 m",   "100 m", "1 km"};
      draw_label(names[static_cast<std::size_t>(lower + decade + 6)], y, decade == 0 ? -1 * scale_ : scale_);
    }
  }
  if (strips_.size() == 1) return;
  // Which of several strips it is.
  const std::string name = name_of(strip.kind);
  draw_text(background_, strip.strip.x + strip.strip.width - 6 * scale_ - text_width(name, style),
            strip.strip.y + 1.05 * style.size, name, style);
}

/// Shades what is below the reference's own uncertainty, and marks where the reference ends.
void Composition::draw_certainty(const StripBox& strip) {
  const ReferenceRun& reference = *comparison_.reference;
  const Box& plot = strip.plot;
  const double bottom = plot.y + plot.height;
  for (std::size_t k = 0; k + 1 < reference.known; ++k) {
    const int left = static_cast<int>(std::lround(plot_x(strip, k)));
    const int right = static_cast<int>(std::lround(plot_x(strip, k + 1)));
    const double error = std::max(reference.uncertainty[k], reference.uncertainty[k + 1]);
    const int top = static_cast<int>(std::lround(plot_y(strip, error)));
    fill_rectangle(background_, left, top, right - left, static_cast<int>(bottom) - top, quiet, 0.25);
  }
  if (reference.known == comparison_.times.size()) return;
  const double end = plot_x(strip, reference.known);
  draw_line(background_, end, plot.y, end, bottom, std::max(1.5, 2 * scale_), alarm);
  const TextStyle style{.size = text_size(14), .color = quiet};
  const std::string text = "reference ends";
  if (text_width(text, style) + 8 * scale_ > plot.x + plot.width - end) return;
  draw_text(background_, end + 5 * scale_, baseline(plot.y, plot.height, style.size), text, style);
}

/// The names of the curves in the reference's strip, in as many lines as there is room for.
void Composition::draw_key(const StripBox& strip) {
  const Box& plot = strip.plot;
  std::vector<std::pair<std::string, Color>> names;
  for (const Run& run : comparison_.runs) {
    std::pair<std::string, Color> entry{name_of(run.panel), accent(run.panel)};
    if (!run.is_reference() && std::ranges::find(names, entry) == names.end()) names.push_back(entry);
  }
  TextStyle style{.size = std::max(9.0, 12 * scale_), .bold = true};
  const auto lines = std::max<std::size_t>(1, static_cast<std::size_t>(strip.strip.height / style.size));
  const double left = plot.x + plot.width + 8 * scale_;
  double x = left;
  double column = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0 && i % lines == 0) {
      x += column + 6 * scale_;
      column = 0;
    }
    style.color = names[i].second;
    const double wide = text_width(names[i].first, style);
    if (x + wide > strip.strip.x + strip.strip.width) break;
    column = std::max(column, wide);
    const double pitch = static_cast<double>(strip.strip.height) / static_cast<double>(lines);
    draw_text(background_, x,
              baseline(strip.strip.y + static_cast<double>(i % lines) * pitch, pitch, style.size),
              names[i].first, style);
  }
}

void Composition::draw_curve(Image& image, const StripBox& strip, std::size_t run, std::size_t end,
                             const Color& color, bool dashed) const {
  const std::vector<double>& values = series_of(comparison_.runs[run], strip.kind);
  const double width = std::max(1.2, 1.8 * scale_);
  const Dash dash = dashed ? dash_of(run) : Dash{1, 0};
  const double period = (dash.drawn + dash.left_out) * std::max(0.6, scale_);
  const double drawn = dash.drawn * std::max(0.6, scale_);
  double from = 0;  // along the curve, since its beginning
  for (std::size_t k = 1; k < std::min(end + 1, values.size()); ++k) {
    const double x0 = plot_x(strip, k - 1);
    const double y0 = plot_y(strip, values[k - 1]);
    const double dx = plot_x(strip, k) - x0;
    const double dy = plot_y(strip, values[k]) - y0;
    const double length = std::hypot(dx, dy);
    if (dash.left_out == 0) {
      draw_line(image, x0, y0, x0 + dx, y0 + dy, width, color);
      continue;
    }
    for (double at = 0; length > 0 && at < length;) {
      const double phase = std::fmod(from + at, period);
      const bool on = phase < drawn;
      const double next = std::min(length, at + std::max((on ? drawn : period) - phase, 1e-6));
      if (on) {
        draw_line(image, x0 + dx * at / length, y0 + dy * at / length, x0 + dx * next / length,
                  y0 + dy * next / length, width, color);
      }
      at = next;
    }
    from += length;
  }
}

/// Triangles at the top where the curve goes on above it.
void Composition::draw_clipped(Image& image, const StripBox& strip, std::size_t run, std::size_t end) const {
  const std::vector<double>& values = series_of(comparison_.runs[run], strip.kind);
  const double top = strip.axis.is_logarithmic ? std::pow(10.0, strip.axis.decades.upper) : strip.axis.high;
  const TextStyle style{.size = std::max(8.0, 11 * scale_), .color = accent(comparison_.runs[run].panel)};
  const double apart = 40 * scale_;
  double last = -1e9;
  for (std::size_t k = 0; k < std::min(end + 1, values.size()); ++k) {
    if (!(values[k] > top) || plot_x(strip, k) < last + apart) continue;
    last = plot_x(strip, k);
    draw_text(image, last - text_width("▲", style) / 2, strip.plot.y + 0.1 * style.size, "▲", style);
  }
}

void Composition::draw_clock(Image& image, std::size_t k) const {
  const TextStyle bold{.size = text_size(22), .color = bright, .bold = true};
  const TextStyle small{.size = text_size(15), .color = quiet};
  const std::string time = fmt::format("{:.2f} s", comparison_.times[k]);
  const std::string count = fmt::format("frame {}/{}", k, comparison_.times.size() - 1);
  const double right = title_.x + title_.width;
  const double base = baseline(title_.y, title_.height, bold.size);
  draw_text(image, right - text_width(time, bold), base, time, bold);
  if (width_ < 900 * scale_) return;
  // Placed by the longest there will be, so that it stands still.
  const double column = text_width(fmt::format("{:.2f} s", comparison_.times.back()), bold) + 16 * scale_;
  draw_text(image, right - column - text_width(count, small), base, count, small);
}

std::string Composition::value_label(const StripBox& strip, std::size_t run, std::size_t k) const {
  const double value = series_of(comparison_.runs[run], strip.kind)[k];
  if (strip.kind == Strip::error) return error_label(value, comparison_.reference->uncertainty[k]);
  return strip.axis.label(value);
}

void Composition::draw_strip(Image& image, const StripBox& strip, std::size_t run, std::size_t k) const {
  const Box& plot = strip.plot;
  const Run& r = comparison_.runs[run];
  const double cursor = plot_x(strip, k);
  draw_line(image, cursor, plot.y, cursor, plot.y + plot.height, std::max(1.0, scale_), bright, 0.45);
  if (r.is_reference()) {
    // It has no error of its own: the strip shows all the others', to compare.
    for (std::size_t other = 0; other < comparison_.runs.size(); ++other) {
      draw_curve(image, strip, other, k, accent(comparison_.runs[other].panel), true);
      draw_clipped(image, strip, other, k);
    }
    return;
  }
  const Color color = accent(r.panel);
  draw_curve(image, strip, run, series_of(comparison_.runs[run], strip.kind).size(), faded(color), false);
  draw_curve(image, strip, run, k, color, false);
  draw_clipped(image, strip, run, k);
  if (k >= series_of(comparison_.runs[run], strip.kind).size()) return;
  const int dot = std::max(2, static_cast<int>(std::lround(5 * scale_)));
  fill_rectangle(image, static_cast<int>(std::lround(cursor - 0.5 * dot)),
                 static_cast<int>(
                     std::lround(plot_y(strip, series_of(comparison_.runs[run], strip.kind)[k]) - 0.5 * dot)),
                 dot, dot, color);
  const std::string value = value_label(strip, run, k);
  TextStyle bold{.size = text_size(22), .color = color, .bold = true};
  const double right = strip.strip.x + strip.strip.width - 6 * scale_;
  const double room = right - plot.x - plot.width - 10 * scale_;
  // By the longest there can be, so that all panels' are of one size.
  const double widest = text_width("≤ 88.8 mm", bold);
  if (widest > room) bold.size *= room / widest;
  draw_text(image, right - text_width(value, bold), baseline(strip.strip.y, strip.strip.height, bold.size),
            value, bold);
}

void Composition::draw_notice(Image& image, std::size_t run, const std::string& text, bool over_all) const {
  const Box& box = panels_[run].picture;
  TextStyle bold{.size = text_size(over_all ? 22 : 16), .color = alarm, .bold = true};
  const double width = box.width - 8 * scale_;
  const double least = over_all ? text_size(14) : 7;
  while (bold.size > least && text_width(text, bold) > width) bold.size *= 0.95;
  const std::vector<std::string> lines = over_all ? wrapped(text, bold, width) : std::vector{text};
  const int height = over_all ? box.height : static_cast<int>(std::lround(1.5 * bold.size));
  const int y = over_all ? box.y : box.y + box.height - height;
  fill_rectangle(image, box.x, y, box.width, height, ground, over_all ? 0.55 : 0.8);
  const double pitch = 1.25 * bold.size;
  double middle = y - pitch * static_cast<double>(lines.size() - 1) / 2;
  for (const std::string& line : lines) {
    draw_text(image, box.x + (box.width - text_width(line, bold)) / 2, baseline(middle, height, bold.size),
              line, bold);
    middle += pitch;
  }
}

void Composition::draw_fate(Image& image, std::size_t run, std::size_t k) const {
  const Run& r = comparison_.runs[run];
  if (r.is_reference() && k >= comparison_.reference->known) {
    draw_notice(image, run, "no reference: " + comparison_.reference->fate, k >= r.poses.size());
  } else if (!r.refusal.empty()) {
    draw_notice(image, run, r.refusal, true);
  } else if (r.diverged && k >= r.poses.size()) {
    draw_notice(image, run, fmt::format("diverged at t = {:.2f} s", *r.diverged), true);
  }
}

Image Composition::frame(int k, const std::vector<Image>& pictures) const {
  Image image = background_;
  const auto index = static_cast<std::size_t>(k);
  draw_clock(image, index);
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    paste(image, pictures[run], panels_[run].picture.x, panels_[run].picture.y);
    draw_fate(image, run, index);
    for (const StripBox& strip : panels_[run].strips) draw_strip(image, strip, run, index);
  }
  return image;
}

}  // namespace substep::render
