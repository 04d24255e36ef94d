#include "render/video/comparison_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "render/video/composition.h"

namespace substep::render {
namespace {

std::string row_title(const Run& run) {
  std::string title = fmt::format("{}  {}", name_of(run.panel), settings_of(run.panel));
  if (!run.panel.title.empty()) title += "  " + run.panel.title;
  return title;
}

std::string fate_of(const Run& run) {
  std::string fate = run.refusal;
  if (run.diverged) fate = fmt::format("diverged at t = {:.2f} s", *run.diverged);
  if (run.unsolved > 0) {
    fate += fmt::format("{}{} steps not solved to the accuracy asked for", fate.empty() ? "" : "; ",
                        run.unsolved);
  }
  return fate;
}

}  // namespace

TextTable table_of(const Comparison& comparison, bool with_times) {
  TextTable table;
  table.head = {"", "RMS error", "at the end", "row solves"};
  if (with_times) table.head.emplace_back("CPU, ms a simulated second");
  const bool has_fates =
      std::ranges::any_of(comparison.runs, [](const Run& run) { return !fate_of(run).empty(); });
  if (has_fates) table.head.emplace_back();
  for (const Run& run : comparison.runs) {
    if (run.is_reference()) continue;
    const bool has_errors = !run.errors.empty();
    std::vector<std::string>& cells = table.rows.emplace_back();
    cells = {row_title(run), has_errors ? length_label(run.rms_error) : "–",
             has_errors ? length_label(run.errors.back()) : "–",
             run.row_solves > 0 ? fmt::format("{}", run.row_solves) : "–"};
    if (with_times) {
      cells.push_back(run.simulated > 0 ? fmt::format("~{:.2g}", 1000 * run.cpu_time / run.simulated) : "–");
    }
    if (has_fates) cells.push_back(fate_of(run));
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
    const double uncertain = *std::ranges::max_element(reference.uncertainty);
    text += fmt::format("; known to {}", uncertain > 0 ? length_label(uncertain) : "< 1 µm");
  }
  if (reference.known == 0) return text + fmt::format("; {}: there are none.", reference.fate);
  if (reference.fate.empty()) return text + ".";
  return text + fmt::format("; {}: they are those up to {:.2f} s.", reference.fate,
                            comparison.times[reference.known - 1]);
}

}  // namespace substep::render
