#include "render/commands/comparison_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "render/video/comparison_table.h"
#include "render/video/panel.h"
#include "sim/commands/warnings.h"
#include "sim/error.h"

namespace substep::render {

void ComparisonOptions::add_to(CLI::App& command) {
  scene.add_to(command);
  command.add_option("--title", title, "What stands above all (the scene's name)");
  add_settings_to(command);
}

void ComparisonOptions::add_settings_to(CLI::App& command) {
  solver.add_to(command);
  add_panels_to(command);
  command.add_option("--start", start_, "Seconds into the run at which the film begins")
      ->capture_default_str();
  command.add_option("--end", end_, "Seconds into the run at which it ends (the duration)");
  command.add_option("--speed", speed, "Seconds of the scene in a second of film: 0.25 is slow motion")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  command.add_option("--fps", frame_rate, "Frames in a second of film")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
}

void ComparisonOptions::add_panels_to(CLI::App& command) {
  command
      .add_option(
          "--panel", panels_,
          "A panel of its own: a1 to a5, an engine, log:FILE or reference; once for each (A1 to A5 and "
          "the reference)")
      ->allow_extra_args(false);
  command.add_option("--panels", panels_file_, "A TOML file of [[panel]] tables")->check(CLI::ExistingFile);
  command.add_flag("--no-reference", no_reference_, "Simulate none, and show no errors");
  cache_.add_to(command);
  command
      .add_option(
          "--reference-substeps", reference_substeps_,
          "The reference is at the step divided by this, its check at half as many; where nothing moves "
          "a fourth of these is enough")
      ->capture_default_str();
  command.add_option("--threads", threads_, "Threads; the result is the same for any number")
      ->capture_default_str();
}

ComparisonSettings ComparisonOptions::settings(const Scene& scene_to_show) {
  const Settings base = solver.settings(scene_to_show);
  ComparisonSettings settings;
  if (panels_file_) {
    PanelFile file = read_panels(*panels_file_, base);
    settings.panels = std::move(file.panels);
    if (title.empty()) title = file.title;
  }
  for (const std::string& text : panels_) settings.panels.push_back(panel_in(text, base));
  if (settings.panels.empty()) {
    settings.panels = default_panels(base);
    if (no_reference_) settings.panels.pop_back();
  }
  settings.step = base.step;
  settings.has_reference = !no_reference_;
  settings.reference_substeps = reference_substeps_;
  // The reference of contacts is A1 itself.
  const bool has_a1 = std::ranges::any_of(settings.panels, [](const PanelChoice& panel) {
    return panel.kind == PanelChoice::Kind::algorithm && panel.settings.algorithm == Algorithm::a1;
  });
  if (has_a1 || settings.has_reference) note_cost_of_a1(scene_to_show);
  settings.start = seconds_in(start_, "--start");
  settings.duration = solver.seconds(scene_to_show);
  if (end_) {
    const double end = seconds_in(*end_, "--end");
    if (!(end >= settings.start && end <= settings.duration)) {
      throw Error(fmt::format(
          "--end {}: must be from --start to the end of the run, {:g} s (--duration makes it longer)", *end_,
          settings.duration));
    }
    settings.duration = end;
  }
  settings.frame_interval = speed / frame_rate;
  settings.threads = threads_;
  settings.cache = cache_.cache();
  if (!(threads_ >= 1 && threads_ <= 64)) {
    throw Error(fmt::format("--threads {}: must be from 1 to 64", threads_));
  }
  return settings;
}

void print_table(const Comparison& comparison) {
  fmt::print("{}", to_text(table_of(comparison, true)));
  if (comparison.reference) fmt::print("{}\n", words_on_reference(comparison));
}

void warn_of(const Scene& scene, const Comparison& comparison) {
  for (const Run& run : comparison.runs) {
    warn_of(scene, fmt::format("{} {}", name_of(run.panel), settings_of(run.panel)), run.violations);
  };
}

}  // namespace substep::render
