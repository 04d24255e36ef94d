#include "render/video/composition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/error.h"

namespace substep::render {

using namespace film_colors;

namespace {

/// Makes text smaller by steps of `factor`, down to `least`, until it fits.
template <typename Fits>
void shrink(double& size, double factor, double least, const Fits& fits) {
  while (size > least && !fits()) size *= factor;
}

}  // namespace

std::string film_title(const Scene& scene, const std::string& given) {
  if (!given.empty()) return given;
  std::string title = scene.name;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
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
    // Prefer large pictures of the usual shape, then pictures with more room around it, and panels of one
    // width, which are easy to compare
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
    throw Error("size {}x{}: a video's must be even, at least 180 each way and at most 7680x4320 in all",
                width, height);
  }
}

Composition::Composition(const Comparison& comparison, const std::string& title, int width, int height,
                         const std::vector<KeyEntry>& key, const std::vector<Strip>& strips)
    : comparison_(comparison),
      titles_(titles_of(comparison.runs)),
      width_(width),
      height_(height),
      scale_(std::sqrt(static_cast<double>(width) * height / (1280.0 * 720))),
      painter_{comparison, scale_},
      legend_style_{.size = painter_.text_size(17), .color = quiet},
      count_style_{.size = painter_.text_size(15), .color = quiet},
      key_style_{.size = painter_.text_size(15)},
      strips_(strips) {
  check_film_size(width, height);
  if (strips_.empty() && comparison.strip) strips_.push_back(*comparison.strip);
  if (!key.empty()) lay_out_key(key);
  lay_out();
  background_ = Image(width_, height_);
  fill_rectangle(background_, 0, 0, width_, height_, ground);
  draw_title(title);
  const double factor = header_factor();
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    draw_header(run, factor);
    const std::vector<StripBox>& boxes = panels_[run].strips;
    for (const StripBox& strip : boxes)
      painter_.draw_ground(background_, strip, run, &strip == &boxes.front());
  }
  draw_key();
}

/// Returns a length in pixels of this film.
int Composition::scaled(double at_720, double least) const {
  return static_cast<int>(std::lround(std::max(least, at_720 * scale_)));
}

/// Returns lines of the settings that all panels share, then of the strips' quantities.
std::vector<std::string> Composition::legend() const {
  std::string strips;
  for (const Strip strip : strips_)
    strips += (strips.empty() ? "strips: " : "; ") + words_of(comparison_, strip);
  const std::string text = titles_.shared + (titles_.shared.empty() || strips.empty() ? "" : " · ") + strips;
  return text.empty() ? std::vector<std::string>{} : wrapped(text, legend_style_, title_.width);
}

void Composition::lay_out() {
  const int gap = scaled(12, 4);
  title_ = {gap, 0, width_ - 2 * gap, scaled(40, 18)};
  const int top =
      title_.height +
      static_cast<int>(1.3 * legend_style_.size * static_cast<double>(legend().size()) + 4 * scale_);
  const int header = scaled(36, 16);
  const int strip = scaled(62, 28);
  const int strips = strip * static_cast<int>(strips_.size());
  painter_.has_names = strips_.size() > 1;
  const int count = static_cast<int>(comparison_.runs.size());
  const std::vector<int> rows =
      rows_for(count, width_ - gap, height_ - top - key_height_, header + strips + gap);
  const auto row_count = static_cast<int>(rows.size());
  const auto width_in = [&](int columns) { return (width_ - (columns + 1) * gap) / columns; };
  const int panel_height = (height_ - top - key_height_ - row_count * gap) / row_count;
  const int narrowest = width_in(rows.front());
  picture_height_ = panel_height - header - strips;
  if (narrowest < 40 || picture_height_ < 24)
    throw Error("size {}x{}: leaves no room for {} panels: make it larger", width_, height_, count);
  // Leave out the axes in narrow panels, where their names would take the curve's room.
  for (const Strip kind : strips_)
    axis_width_ = std::max(axis_width_, painter_.axis_width(axis_of(comparison_, kind)));
  painter_.has_axis = narrowest > axis_width_ + 10.5 * painter_.text_size(14);
  int y = top;
  for (const int columns : rows) {
    for (int column = 0; column < columns; ++column) {
      const int x = gap + column * (width_in(columns) + gap);
      Panel& panel = panels_.emplace_back();
      panel.header = {x, y, width_in(columns), header};
      panel.picture = {x, y + header, width_in(columns), picture_height_};
      lay_out_strips(panel, y + header + picture_height_, strip);
    }
    y += panel_height + gap;
  }
}

void Composition::lay_out_strips(Panel& panel, int y, int height) const {
  const int x = panel.picture.x;
  const int width = panel.picture.width;
  // Leave room for the axis at the left and for the value at the right.
  const int left =
      painter_.has_axis ? static_cast<int>(axis_width_ + std::max(5.0, 8 * scale_)) : scaled(6, 4);
  const int right = std::clamp(static_cast<int>(0.33 * width), 52, scaled(126, 60));
  const int margin = scaled(8, 4);
  for (const Strip kind : strips_) {
    StripBox& box = panel.strips.emplace_back(StripBox{kind, axis_of(comparison_, kind)});
    box.strip = {x, y, width, height};
    box.plot = {x + left, y + margin, std::max(8, width - left - right), std::max(0, height - 2 * margin)};
    y += height;
  }
}

/// Splits the key into lines, with text that fits in one line or is as small as can be read.
void Composition::lay_out_key(const std::vector<KeyEntry>& key) {
  const double width = width_ - 2 * scaled(12, 4);
  const auto width_of = [&](auto entry, const auto end) {
    double sum = 0;
    for (; entry != end; ++entry) sum += text_width(entry->first, key_style_);
    return sum;
  };
  shrink(key_style_.size, 0.97, 9, [&] { return width_of(key.begin(), key.end()) <= width; });
  double room = 0;
  for (auto begin = key.begin(); begin != key.end();) {
    // Keep an item's entries on one line: its last one ends in two spaces.
    const auto ends = [](const KeyEntry& entry) { return entry.first.ends_with("  "); };
    const auto last = std::find_if(begin, key.end(), ends);
    const auto end = last == key.end() ? last : last + 1;
    const double wide = width_of(begin, end);
    if (key_.empty() || wide > room) {
      key_.emplace_back();
      room = width;
    }
    key_.back().insert(key_.back().end(), begin, end);
    room -= wide;
    begin = end;
  }
  const double more = 1.3 * key_style_.size * static_cast<double>(key_.size() - 1);
  key_height_ = scaled(26, 14) + static_cast<int>(more);
}

void Composition::draw_title(const std::string& title) {
  TextStyle bold{.size = painter_.text_size(24), .color = bright, .bold = true};
  const TextStyle clock{.size = painter_.text_size(22), .bold = true};
  double room = title_.width - text_width("00.00 s", clock) - 16 * scale_;
  if (has_count()) room -= text_width(count_text(comparison_.times.size() - 1), count_style_) + 16 * scale_;
  shrink(bold.size, 0.95, 8, [&] { return text_width(title, bold) <= room; });
  draw_text(background_, title_.x, baseline(title_.y, title_.height, bold.size), cut(title, bold, room),
            bold);
  double middle = title_.y + title_.height + 0.5 * legend_style_.size;
  for (const std::string& line : legend()) {
    draw_text(background_, title_.x, baseline(middle, 0, legend_style_.size), line, legend_style_);
    middle += 1.3 * legend_style_.size;
  }
}

/// Returns the factor by which all headers shrink, so that the longest fits or is as small as can be read.
double Composition::header_factor() const {
  double factor = 1;
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    const std::string& words = titles_.words[run];
    const std::string name = name_of(comparison_.runs[run].panel);
    const auto fits = [&] {
      const TextStyle bold{.size = factor * painter_.text_size(24), .bold = true};
      const double width = words.empty() ? 0 : text_width(words, {.size = factor * painter_.text_size(22)});
      return 28 * scale_ + text_width(name, bold) + width <= panels_[run].header.width;
    };
    while (!fits() && factor * painter_.text_size(22) > 9) factor *= 0.97;
  }
  return factor;
}

void Composition::draw_header(std::size_t run, double factor) {
  const Box& box = panels_[run].header;
  const Color color = accent(comparison_.runs[run].panel);
  fill_rectangle(background_, box.x, box.y, box.width, box.height, surface);
  const int bar = scaled(4, 2);
  fill_rectangle(background_, box.x, box.y, bar, box.height, color);
  const TextStyle bold{.size = factor * painter_.text_size(24), .color = color, .bold = true};
  const TextStyle plain{.size = factor * painter_.text_size(22), .color = bright};
  double x = box.x + bar + 8 * scale_;
  const std::string name = name_of(comparison_.runs[run].panel);
  draw_text(background_, x, baseline(box.y, box.height, bold.size), name, bold);
  x += text_width(name, bold) + 10 * scale_;
  draw_text(background_, x, baseline(box.y, box.height, bold.size),
            cut(titles_.words[run], plain, box.x + box.width - x), plain);
}

void Composition::draw_key() {
  TextStyle style = key_style_;
  double y = baseline(height_ - key_height_, scaled(26, 14), style.size) - 2 * scale_;
  for (const std::vector<KeyEntry>& line : key_) {
    double x = title_.x;
    for (const auto& [text, color] : line) {
      style.color = color;
      draw_text(background_, x, y, text, style);
      x += text_width(text, style);
    }
    y += 1.3 * style.size;
  }
}

/// Returns the number of film frame k, which stands beside the clock.
std::string Composition::count_text(std::size_t k) const {
  return fmt::format("frame {}/{}", k, comparison_.times.size() - 1);
}

void Composition::draw_clock(Image& image, std::size_t k) const {
  const TextStyle bold{.size = painter_.text_size(22), .color = bright, .bold = true};
  const std::string time = fmt::format("{:.2f} s", comparison_.times[k]);
  const std::string count = count_text(k);
  const double right = title_.x + title_.width;
  const double base = baseline(title_.y, title_.height, bold.size);
  draw_text(image, right - text_width(time, bold), base, time, bold);
  if (!has_count()) return;
  // Place the count by the longest time of the film, so that it stands still.
  const double column = text_width(fmt::format("{:.2f} s", comparison_.times.back()), bold) + 16 * scale_;
  draw_text(image, right - column - text_width(count, count_style_), base, count, count_style_);
}

/// Draws a notice over a run's whole picture, or at its bottom.
void Composition::draw_notice(Image& image, std::size_t run, const std::string& text, bool over_all) const {
  const Box& box = panels_[run].picture;
  TextStyle bold{.size = painter_.text_size(over_all ? 22 : 16), .color = alarm, .bold = true};
  const double width = box.width - 8 * scale_;
  shrink(bold.size, 0.95, over_all ? painter_.text_size(14) : 9,
         [&] { return text_width(text, bold) <= width; });
  const std::vector<std::string> lines = wrapped(text, bold, width);
  const double pitch = 1.25 * bold.size;
  const double more = pitch * static_cast<double>(lines.size() - 1);
  const int height = over_all ? box.height : static_cast<int>(std::lround(1.5 * bold.size + more));
  const int y = over_all ? box.y : box.y + box.height - height;
  fill_rectangle(image, box.x, y, box.width, height, ground, over_all ? 0.55 : 0.8);
  double middle = y - more / 2;
  for (const std::string& line : lines) {
    draw_text(image, box.x + (box.width - text_width(line, bold)) / 2, baseline(middle, height, bold.size),
              line, bold);
    middle += pitch;
  }
}

/// Writes the reason of an early end of the run, or of the reference, on a run's picture.
void Composition::draw_end(Image& image, std::size_t run, std::size_t k) const {
  const Run& shown = comparison_.runs[run];
  if (shown.is_reference() && k >= comparison_.reference->known) {
    draw_notice(image, run, "no reference: " + comparison_.reference->fate, k >= shown.poses.size());
  } else if (!shown.refusal.empty()) {
    draw_notice(image, run, shown.refusal, true);
  } else if (shown.diverged && k >= shown.poses.size()) {
    draw_notice(image, run, fmt::format("diverged at t = {:.2f} s", *shown.diverged), true);
  }
}

Image Composition::frame(int k, const std::vector<Image>& pictures) const {
  Image image = background_;
  const auto index = static_cast<std::size_t>(k);
  draw_clock(image, index);
  for (std::size_t run = 0; run < panels_.size(); ++run) {
    paste(image, pictures[run], panels_[run].picture.x, panels_[run].picture.y);
    draw_end(image, run, index);
    for (const StripBox& strip : panels_[run].strips) painter_.draw(image, strip, run, index);
  }
  return image;
}

}  // namespace substep::render
