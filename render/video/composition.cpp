#include "render/video/composition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "render/text.h"
#include "sim/error.h"

namespace substep {
namespace {

constexpr Color ground{15, 18, 24};
constexpr Color surface{24, 29, 37};
constexpr Color grid{52, 60, 72};
constexpr Color bright{236, 240, 245};
constexpr Color quiet{146, 156, 170};
constexpr Color alarm{255, 122, 92};

/// What distinguishes an algorithm from its neighbours, for someone who has not read the report.
std::string_view description(const Run& run) {
  if (run.is_reference) return "small steps, solved directly";
  switch (run.settings.algorithm) {
    case Algorithm::a1:
      return "all rows at once";
    case Algorithm::a2:
      return "row by row, iterated";
    case Algorithm::a3:
      return "sub-steps, exact";
    case Algorithm::a4:
      return "sub-steps, approximate";
    case Algorithm::a5:
      return "sub-steps, as in Havok";
  }
  return "";
}

/// `color` faded into the strip's ground. Not by drawing with an alpha: where a curve's pieces meet, that
/// would show as beads.
Color faded(const Color& color) {
  Color result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = static_cast<std::uint8_t>(surface[i] + (color[i] - surface[i]) * 38 / 100);
  }
  return result;
}

/// The baseline that centres capitals and digits of this size in a box.
double baseline(double y, double height, double size) {
  return y + height / 2 + 0.31 * size;
}

}  // namespace

Color accent(Algorithm algorithm) {
  switch (algorithm) {
    case Algorithm::a1:
      return {102, 187, 245};
    case Algorithm::a2:
      return {242, 163, 60};
    case Algorithm::a3:
      return {62, 201, 160};
    case Algorithm::a4:
      return {240, 222, 92};
    case Algorithm::a5:
      return {233, 138, 200};
  }
  return reference_accent;
}

std::string length_label(double metres) {
  struct Unit {
    double size;
    std::string_view name;
  };
  constexpr std::array<Unit, 4> units{{{1e3, "km"}, {1, "m"}, {1e-3, "mm"}, {1e-6, "µm"}}};
  if (metres >= 1e6) return "> 1000 km";
  for (const Unit& unit : units) {
    const double value = metres / unit.size;
    // 0.9995 would print as 1.00 of this unit; below, the next smaller unit serves.
    if (value >= 0.9995) {
      return fmt::format("{:.{}f} {}", value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0, unit.name);
    }
  }
  return metres > 0 ? "< 1 µm" : "0";
}

double ErrorScale::height(double metres) const {
  const double smallest = std::pow(10.0, lower);
  const double decades = std::log10(std::max(metres, smallest)) - lower;
  return std::min(1.0, decades / (upper - lower));
}

ErrorScale error_scale(const Comparison& comparison) {
  std::vector<double> errors;
  for (const Run& run : comparison.runs) {
    for (const double error : run.errors) {
      if (error > 0) errors.push_back(error);
    }
  }
  ErrorScale scale;
  if (errors.empty()) return scale;
  std::sort(errors.begin(), errors.end());
  // A run that explodes, and the first instants in which all agree, would press the rest into a line.
  const double high = std::min(errors.back(), 100.0);
  const double low = std::max(errors[errors.size() / 20], 1e-6);
  scale.upper = static_cast<int>(std::ceil(std::log10(high) - 1e-9));
  scale.upper = std::max(scale.upper, -4);
  scale.lower =
      std::clamp(static_cast<int>(std::floor(std::log10(low) + 1e-9)), scale.upper - 5, scale.upper - 2);
  return scale;
}

Composition::Composition(const Comparison& comparison, const std::string& title, int width, int height)
    : comparison_(comparison),
      width_(width),
      height_(height),
      scale_(std::min(height / 720.0, width / 1280.0)),
      error_scale_(error_scale(comparison)) {
  if (width < 320 || height < 180 || width > 7680 || height > 4320 || width % 2 != 0 || height % 2 != 0) {
    throw Error(fmt::format("size {}x{}: a video's must be even, from 320x180 to 7680x4320", width, height));
  }
  lay_out();
  draw_background(title);
}

double Composition::text_size(double at_720) const {
  return std::max(10.0, at_720 * scale_);
}

Color Composition::color_of(std::size_t run) const {
  const Run& r = comparison_.runs[run];
  return r.is_reference ? reference_accent : accent(r.settings.algorithm);
}

void Composition::lay_out() {
  const auto scaled = [this](double at_720, double least) {
    return static_cast<int>(std::lround(std::max(least, at_720 * scale_)));
  };
  const int gap = scaled(12, 4);
  title_ = {gap, 0, width_ - 2 * gap, scaled(48, 20)};
  const int header = scaled(28, 16);
  const int strip = scaled(62, 28);
  const int panel_width = (width_ - 4 * gap) / 3;
  const int panel_height = (height_ - title_.height - 2 * gap) / 2;
  picture_width_ = panel_width;
  picture_height_ = panel_height - header - strip;
  for (int i = 0; i < static_cast<int>(comparison_.runs.size()); ++i) {
    const int x = gap + (i % 3) * (panel_width + gap);
    const int y = title_.height + (i / 3) * (panel_height + gap);
    Panel panel;
    panel.header = {x, y, panel_width, header};
    panel.picture = {x, y + header, picture_width_, picture_height_};
    panel.strip = {x, y + header + picture_height_, panel_width, strip};
    // Room for the axis at the left and for the value at the right.
    const int left = scaled(46, 6);
    const int right = comparison_.runs[static_cast<std::size_t>(i)].is_reference ? gap : scaled(84, 50);
    const int margin = scaled(8, 4);
    panel.plot = {panel.strip.x + left, panel.strip.y + margin, panel_width - left - right,
                  strip - 2 * margin};
    panels_.push_back(panel);
  }
}

double Composition::plot_x(const Panel& panel, std::size_t k) const {
  const std::size_t last = std::max<std::size_t>(1, comparison_.times.size() - 1);
  return panel.plot.x + static_cast<double>(k) / static_cast<double>(last) * panel.plot.width;
}

void Composition::draw_background(const std::string& title) {
  background_ = Image(width_, height_);
  fill_rectangle(background_, 0, 0, width_, height_, ground);
  const TextStyle bold{.size = text_size(24), .color = bright, .bold = true};
  draw_text(background_, title_.x, baseline(title_.y, title_.height, bold.size), title, bold);
  const TextStyle small{.size = text_size(15), .color = quiet};
  const std::string legend = "strips: RMS distance of the bodies’ points from the reference";
  const double left = title_.x + text_width(title, bold) + 22 * scale_;
  const double room = title_.width - 250 * scale_ - left;
  if (text_width(legend, small) < room) {
    draw_text(background_, left, baseline(title_.y, title_.height, small.size) + 2 * scale_, legend, small);
  }
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    const Panel& panel = panels_[run];
    draw_header(panel, run);
    fill_rectangle(background_, panel.strip.x, panel.strip.y, panel.strip.width, panel.strip.height, surface);
    draw_grid(panel, panel.plot.x - panel.strip.x > 30);
  }
}

void Composition::draw_header(const Panel& panel, std::size_t run) {
  const Run& r = comparison_.runs[run];
  const Box& box = panel.header;
  fill_rectangle(background_, box.x, box.y, box.width, box.height, surface);
  const int bar = std::max(2, static_cast<int>(std::lround(4 * scale_)));
  fill_rectangle(background_, box.x, box.y, bar, box.height, color_of(run));

  // label() begins with the algorithm's letter and two spaces.
  const std::string settings = label(r.settings);
  const std::size_t space = std::min(settings.find("  "), settings.size());
  const std::string letter = r.is_reference ? "Reference" : settings.substr(0, space);
  std::string rest = settings.substr(std::min(settings.size(), space + 2));
  if (r.is_reference) rest = settings;

  const TextStyle bold{.size = text_size(18), .color = color_of(run), .bold = true};
  const TextStyle plain{.size = text_size(15), .color = bright};
  const TextStyle small{.size = text_size(14), .color = quiet};
  double x = box.x + bar + 8 * scale_;
  draw_text(background_, x, baseline(box.y, box.height, bold.size), letter, bold);
  x += text_width(letter, bold) + 9 * scale_;
  const double right = box.x + box.width - 8 * scale_;
  const double settings_left = right - text_width(rest, small);
  // Where not all fits, the settings stay: they are what the run can be repeated by.
  const bool fits = settings_left > x;
  if (fits) {
    draw_text(background_, settings_left, baseline(box.y, box.height, small.size), rest, small);
  }
  const std::string_view words = description(r);
  if (x + text_width(words, plain) + 10 * scale_ < (fits ? settings_left : right)) {
    draw_text(background_, x, baseline(box.y, box.height, plain.size), words, plain);
  }
}

void Composition::draw_grid(const Panel& panel, bool labels) {
  const Box& plot = panel.plot;
  const int decades = error_scale_.upper - error_scale_.lower;
  const TextStyle style{.size = text_size(12), .color = quiet};
  for (int decade = 0; decade <= decades; ++decade) {
    const double y = plot.y + plot.height * (1 - static_cast<double>(decade) / decades);
    draw_line(background_, plot.x, y, plot.x + plot.width, y, 1, grid);
    // The top and the bottom: between them there is no room for more.
    if (!labels || (decade != 0 && decade != decades)) continue;
    constexpr std::array<std::string_view, 10> names{"1 µm",  "10 µm", "0.1 mm", "1 mm",  "1 cm",
                                                     "10 cm", "1 m",   "10 m",   "100 m", "1 km"};
    const int index = error_scale_.lower + decade + 6;
    const std::string_view text = names[static_cast<std::size_t>(index)];
    const double offset = decade == 0 ? -1 * scale_ : 1 * scale_;
    draw_text(background_, plot.x - 5 * scale_ - text_width(text, style), y + 0.31 * style.size + offset,
              text, style);
  }
}

void Composition::draw_curve(Image& image, const Panel& panel, std::size_t run, std::size_t end,
                             const Color& color) const {
  const Box& plot = panel.plot;
  const std::vector<double>& errors = comparison_.runs[run].errors;
  const auto y = [&](std::size_t k) {
    return plot.y + plot.height * (1 - std::max(0.0, error_scale_.height(errors[k])));
  };
  const double width = std::max(1.2, 1.8 * scale_);
  for (std::size_t k = 1; k < std::min(end + 1, errors.size()); ++k) {
    draw_line(image, plot_x(panel, k - 1), y(k - 1), plot_x(panel, k), y(k), width, color);
  }
}

void Composition::draw_clock(Image& image, std::size_t k) const {
  const TextStyle bold{.size = text_size(22), .color = bright, .bold = true};
  const TextStyle small{.size = text_size(15), .color = quiet};
  const std::string time = fmt::format("{:.2f} s", comparison_.times[k]);
  const std::string count = fmt::format("frame {}/{}{}", k, comparison_.times.size() - 1,
                                        comparison_.is_nearest ? ", nearest step" : "");
  const double right = title_.x + title_.width;
  const double base = baseline(title_.y, title_.height, bold.size);
  draw_text(image, right - text_width(time, bold), base, time, bold);
  // Placed by the longest there will be, so that it stands still.
  const double column = text_width(fmt::format("{:.2f} s", comparison_.times.back()), bold) + 16 * scale_;
  draw_text(image, right - column - text_width(count, small), base, count, small);
}

void Composition::draw_strip(Image& image, std::size_t run, std::size_t k) const {
  const Panel& panel = panels_[run];
  const Box& plot = panel.plot;
  const Run& r = comparison_.runs[run];
  const double cursor = plot_x(panel, k);
  draw_line(image, cursor, plot.y, cursor, plot.y + plot.height, std::max(1.0, scale_), bright, 0.45);
  if (r.is_reference) {
    // It has no error of its own: the strip shows all the others', to compare.
    for (std::size_t other = 0; other + 1 < comparison_.runs.size(); ++other) {
      draw_curve(image, panel, other, k, color_of(other));
    }
    return;
  }
  draw_curve(image, panel, run, r.errors.size(), faded(color_of(run)));
  draw_curve(image, panel, run, k, color_of(run));
  if (r.errors.empty()) return;
  const double error = r.errors[std::min(k, r.errors.size() - 1)];
  const int dot = std::max(2, static_cast<int>(std::lround(5 * scale_)));
  const double dot_y = plot.y + plot.height * (1 - std::max(0.0, error_scale_.height(error)));
  fill_rectangle(image, static_cast<int>(std::lround(cursor - 0.5 * dot)),
                 static_cast<int>(std::lround(dot_y - 0.5 * dot)), dot, dot, color_of(run));
  const TextStyle bold{.size = text_size(16), .color = color_of(run), .bold = true};
  const std::string value = length_label(error);
  const double right = panel.strip.x + panel.strip.width - 8 * scale_;
  draw_text(image, right - text_width(value, bold), baseline(panel.strip.y, panel.strip.height, bold.size),
            value, bold);
}

void Composition::draw_fate(Image& image, std::size_t run, std::size_t k) const {
  const Run& r = comparison_.runs[run];
  if (!r.diverged || k < r.poses.size()) return;
  const Box& box = panels_[run].picture;
  fill_rectangle(image, box.x, box.y, box.width, box.height, ground, 0.55);
  const TextStyle bold{.size = text_size(22), .color = alarm, .bold = true};
  const std::string text = fmt::format("diverged at t = {:.2f} s", *r.diverged);
  draw_text(image, box.x + (box.width - text_width(text, bold)) / 2, baseline(box.y, box.height, bold.size),
            text, bold);
}

Image Composition::frame(int k, const std::vector<Image>& pictures) const {
  Image image = background_;
  const auto index = static_cast<std::size_t>(k);
  draw_clock(image, index);
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    paste(image, pictures[run], panels_[run].picture.x, panels_[run].picture.y);
    draw_fate(image, run, index);
    draw_strip(image, run, index);
  }
  return image;
}

}  // namespace substep
