#include "render/video/titles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <span>
#include <string_view>

#include "render/inks.h"
#include "sim/model/settings_fields.h"

namespace substep::render {
namespace {

/// A setting in words. Settings with equal keys can be compared: iterations of a step have another key than
/// iterations of a sub-step.
struct Item {
  const SettingsField* field;
  std::string key;
  std::string words;
};

std::string counted(int count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

Item item_of(const Settings& settings, const SettingsPart& part, bool has_substeps) {
  const std::string key(part.field->name);
  if (key == "substeps") return {part.field, key, counted(settings.substeps, "sub-step")};
  if (key == "iterations") {
    return {part.field, has_substeps ? "iterations of a sub-step" : key,
            counted(settings.iterations, "iteration")};
  }
  if (key == "joints") return {part.field, key, part.text + " joints"};
  if (key == "step") {
    const double rate = 1 / settings.step;
    const bool is_whole = std::abs(rate - std::round(rate)) < 1e-9 * rate;
    return {part.field, key,
            is_whole ? fmt::format("{:.0f} Hz", rate) : fmt::format("h = {:.3g} s", settings.step)};
  }
  return {part.field, key, part.text};
}

/// Returns whether a label omits the field, though the panel's algorithm reads it.
bool is_left_out(const PanelChoice& panel, const SettingsField& field, const std::vector<Item>& items) {
  return panel.kind == PanelChoice::Kind::algorithm && field.label.group != 0 &&
         field.is_read_by(panel.settings.algorithm) &&
         std::ranges::none_of(items, [&](const Item& item) { return item.field == &field; });
}

std::vector<Item> items_of(const PanelChoice& panel) {
  std::vector<Item> items;
  const bool is_engine = panel.kind == PanelChoice::Kind::engine;
  if (panel.kind == PanelChoice::Kind::reference || !panel.author.empty()) return items;
  const bool has_substeps = !is_engine && field_named("substeps").is_read_by(panel.settings.algorithm);
  for (const SettingsPart& part : parts_of(panel.settings)) {
    const bool is_iterations = part.field->name == "iterations";
    if (is_engine && part.field->name != "step" && !(is_iterations && engine_of(panel).has_iterations))
      continue;
    items.push_back(item_of(panel.settings, part, has_substeps));
  }
  return items;
}

/// Describes an algorithm in few words, for readers who do not know the report.
std::string summary_of(const PanelChoice& panel) {
  if (panel.kind == PanelChoice::Kind::log) return panel.author.empty() ? "finished run" : "";
  if (panel.kind != PanelChoice::Kind::algorithm) return "";
  switch (panel.settings.algorithm) {
    case Algorithm::a1:
      return "all rows at once";
    case Algorithm::a2:
      return "row by row";
    case Algorithm::a3:
      return "exact sub-steps";
    case Algorithm::a4:
      return "approximate";
    case Algorithm::a5:
      return "as in Havok";
    case Algorithm::soft:
      return "soft rows";
    case Algorithm::avbd:
      return "body by body";
  }
  return "";
}

/// Returns the colour of a text such as "#5db4ea".
Color color_in(const char* ink) {
  const int rgb = std::stoi(ink + 1, nullptr, 16);
  const auto channel = [&](int shift) { return static_cast<std::uint8_t>(rgb >> shift); };
  return {channel(16), channel(8), channel(0)};
}

/// Returns a mixture: `percent` of `color`, the rest of `below`.
Color mixed(const Color& color, const Color& below, int percent) {
  Color result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = static_cast<std::uint8_t>(below[i] + (color[i] - below[i]) * percent / 100);
  }
  return result;
}

/// Returns one of seven shades of a colour: 0 is the colour itself, odd ones are mixed with `away`, even ones
/// with grey.
Color shaded(const char* ink, int shade, const Color& away) {
  constexpr Color grey{100, 104, 112};
  constexpr std::array percents{100, 45, 50, 72, 75, 22, 28};
  const auto index = static_cast<std::size_t>(shade) % percents.size();
  return mixed(color_in(ink), index % 2 == 1 ? away : grey, percents.at(index));
}

struct Unit {
  double size;
  std::string_view name;
};

/// Returns three digits of `value` in the first unit that it reaches, of units in falling order; ""
/// below all units.
std::string in_units(double value, std::span<const Unit> units) {
  for (const Unit& unit : units) {
    const double count = value / unit.size;
    // 0.9995 would print as 1.00 of this unit; below, the next smaller unit serves.
    if (count >= 0.9995) {
      return fmt::format("{:.{}f} {}", count, count < 9.995 ? 2 : count < 99.95 ? 1 : 0, unit.name);
    }
  }
  return "";
}

/// Returns why a run ended early and its number of unsolved steps; "" for a whole run.
std::string end_of(const Run& run) {
  std::string text = run.refusal;
  if (run.diverged) text = fmt::format("diverged at t = {:.2f} s", *run.diverged);
  if (run.unsolved > 0) {
    text += fmt::format("{}{} steps not solved to the accuracy asked for", text.empty() ? "" : "; ",
                        run.unsolved);
  }
  return text;
}

}  // namespace

std::string name_of(const PanelChoice& panel) {
  if (panel.kind == PanelChoice::Kind::engine) return engine_of(panel).label;
  if (panel.kind == PanelChoice::Kind::reference) return "Reference";
  return panel.author.empty() ? std::string(title_of(panel.settings.algorithm)) : panel.author;
}

std::string settings_of(const PanelChoice& panel) {
  // label() begins with the algorithm's name and two spaces.
  const std::string all = label(panel.settings);
  const std::string settings = all.substr(all.find("  ") + 2);
  switch (panel.kind) {
    case PanelChoice::Kind::algorithm:
      return settings;
    case PanelChoice::Kind::log:
      return panel.log.filename().string() + (panel.author.empty() ? "  " + settings : "");
    case PanelChoice::Kind::engine: {
      const std::string step = all.substr(all.rfind("  ") + 2);
      return engine_of(panel).has_iterations ? fmt::format("m={}  {}", panel.settings.iterations, step)
                                             : step;
    }
    case PanelChoice::Kind::reference:
      break;
  }
  return "";
}

Titles titles_of(const std::vector<Run>& runs) {
  std::vector<std::vector<Item>> items;
  std::vector<std::string> keys;  // in the order of label()
  for (const Run& run : runs) {
    items.push_back(items_of(run.panel));
    for (const Item& item : items.back()) {
      if (std::ranges::find(keys, item.key) == keys.end()) keys.push_back(item.key);
    }
  }
  const auto with_items =
      std::ranges::count_if(items, [](const std::vector<Item>& list) { return !list.empty(); });
  // Sort the settings into those that differ between panels and those for the legend.
  std::vector<std::string> shared;
  std::set<std::string> differing;
  for (const std::string& key : keys) {
    std::vector<std::string> values;
    const SettingsField* field = nullptr;
    for (const std::vector<Item>& of_run : items) {
      for (const Item& item : of_run) {
        if (item.key != key) continue;
        values.push_back(item.words);
        field = item.field;
      }
    }
    bool is_missing = false;
    for (std::size_t i = 0; i < runs.size(); ++i)
      is_missing = is_missing || is_left_out(runs[i].panel, *field, items[i]);
    // Put a number of sub-steps or iterations that only one of several panels has into its title.
    const bool is_alone = values.size() == 1 && with_items > 1 && (key == "substeps" || key == "iterations");
    if (is_alone || is_missing || std::ranges::adjacent_find(values, std::not_equal_to<>()) != values.end()) {
      differing.insert(key);
    } else if (key != "iterations of a sub-step" || values.front() != "1 iteration") {
      shared.push_back(values.front());
    }
  }
  // Move the step's rate to the legend's end.
  std::stable_partition(shared.begin(), shared.end(),
                        [](const std::string& words) { return !words.ends_with(" Hz"); });
  Titles titles;
  titles.shared = fmt::format("{}", fmt::join(shared, " · "));
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<std::string> own;
    for (const Item& item : items[i]) {
      if (differing.contains(item.key)) own.push_back(item.words);
    }
    const std::string& given = runs[i].panel.title;
    const std::string words = fmt::format("{}", fmt::join(own, ", "));
    titles.words.push_back(!given.empty() ? given : own.empty() ? summary_of(runs[i].panel) : words);
  }
  return titles;
}

std::string curve_name(const std::vector<Run>& runs, const PanelChoice& panel) {
  const std::string name = name_of(panel);
  std::string settings;
  for (const SettingsPart& part : parts_of(panel.settings)) {
    const auto differs = [&](const Run& other) {
      const std::vector<SettingsPart> parts = parts_of(other.panel.settings);
      return name_of(other.panel) == name &&
             std::ranges::find(parts, part.text, &SettingsPart::text) == parts.end();
    };
    if (std::ranges::any_of(runs, differs)) settings += " " + part.text;
  }
  return name + settings;
}

Color accent(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).dark, panel.shade, {255, 255, 255});
}

Color accent_on_white(const PanelChoice& panel) {
  return shaded(inks.at(static_cast<std::size_t>(hue_of(panel))).light, panel.shade, {0, 0, 0});
}

Color faded(const Color& color) {
  return mixed(color, film_colors::surface, 38);
}

std::string html_color(const Color& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

std::string length_label(double metres) {
  constexpr std::array<Unit, 4> units{{{1e3, "km"}, {1, "m"}, {1e-3, "mm"}, {1e-6, "µm"}}};
  if (metres >= 1e6) return "> 1000 km";
  const std::string text = in_units(metres, units);
  return !text.empty() ? text : metres > 0 ? "< 1 µm" : "0";
}

std::string error_label(double metres, double certain) {
  if (metres >= certain) return length_label(metres);
  const std::string bound = length_label(certain);
  return bound.starts_with('<') ? bound : "≤ " + bound;
}

std::string energy_label(double joules) {
  constexpr std::array<Unit, 5> units{{{1e6, "MJ"}, {1e3, "kJ"}, {1, "J"}, {1e-3, "mJ"}, {1e-6, "µJ"}}};
  if (!(std::abs(joules) < 1e9)) return joules < 0 ? "< −1000 MJ" : "> 1000 MJ";
  const std::string text = in_units(std::abs(joules), units);
  return text.empty() ? "0 J" : fmt::format("{}{}", joules < 0 ? "−" : "+", text);
}

TextTable table_of(const Comparison& comparison, bool with_times) {
  TextTable table{{"", "RMS error", "at the end", "row solves"}, {}};
  if (with_times) table.head.emplace_back("CPU, ms a simulated second");
  const bool has_ends =
      std::ranges::any_of(comparison.runs, [](const Run& run) { return !end_of(run).empty(); });
  if (has_ends) table.head.emplace_back();
  for (const Run& run : comparison.runs) {
    if (run.is_reference()) continue;
    std::string title = fmt::format("{}  {}", name_of(run.panel), settings_of(run.panel));
    if (!run.panel.title.empty()) title += "  " + run.panel.title;
    std::vector<std::string>& cells = table.rows.emplace_back();
    cells = {title, "–", "–", run.row_solves > 0 ? fmt::format("{}", run.row_solves) : "–"};
    if (!run.errors.empty()) {
      const std::vector<double>& uncertainty = comparison.reference->uncertainty;
      cells[1] = error_label(run.rms_error, std::ranges::max(uncertainty));
      cells[2] = error_label(run.errors.back(), uncertainty[run.errors.size() - 1]);
    }
    if (with_times) {
      cells.push_back(run.simulated > 0 ? fmt::format("~{:.2g}", 1000 * run.cpu_time / run.simulated) : "–");
    }
    if (has_ends) cells.push_back(end_of(run));
  }
  return table;
}

std::string words_on_reference(const Comparison& comparison) {
  if (!comparison.reference) return "";
  const ReferenceRun& reference = *comparison.reference;
  std::string text =
      fmt::format("Errors are RMS distances of the bodies’ points from the reference: {}", reference.method);
  if (reference.is_a1) text += "; that of A1 is from its own smaller steps";
  if (!reference.uncertainty.empty()) {
    const double uncertain = std::ranges::max(reference.uncertainty);
    text += fmt::format("; known to {}", uncertain > 0 ? length_label(uncertain) : "< 1 µm");
  }
  if (reference.known == 0) return text + fmt::format("; {}: there are none.", reference.fate);
  if (reference.fate.empty()) return text + ".";
  return text + fmt::format("; {}: they are those up to {:.2f} s.", reference.fate,
                            comparison.times[reference.known - 1]);
}

}  // namespace substep::render
