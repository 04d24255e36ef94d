#include "sim/commands/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <iterator>

#include "sim/log/file_output.h"
#include "sim/measure/text_table.h"

namespace substep {

Progress::Progress() : is_terminal_(::isatty(STDERR_FILENO) != 0) {}

void Progress::clear() {
  if (is_shown_) fmt::print(stderr, "\r\x1b[K");
  is_shown_ = false;
}

void Progress::show(std::string_view stage, double fraction) {
  if (!is_terminal_) return;
  const Clock::time_point now = Clock::now();
  if (stage != stage_) {
    stage_ = stage;
    stage_start_ = now;
  } else if (now - last_shown_ < std::chrono::milliseconds(200)) {
    return;
  }
  last_shown_ = now;
  is_shown_ = true;
  std::string line = fmt::format("{} {:.0f} %", stage_, 100 * fraction);
  const double elapsed = std::chrono::duration<double>(now - stage_start_).count();
  // Estimate the time left only when the estimate no longer jumps.
  if (elapsed > 0.5 && fraction > 0.01)
    line += fmt::format(", {:.0f} s left", std::ceil(elapsed * (1 - fraction) / fraction));
  fmt::print(stderr, "\r\x1b[K{}", line);
  std::fflush(stderr);
}

void warn_of(const Scene& scene, const std::string& label, const std::vector<Violation>& violations) {
  std::fflush(stdout);
  for (const Violation& violation : violations) {
    const bool is_bounded = violation.severity == Violation::Severity::warning;
    fmt::print(stderr, "substep: warning: {}: {}: {}{}\n", scene.name, label,
               is_bounded ? "" : "not bounded: ", violation.text);
  }
}

void OutputOption::add_to(CLI::App& command) {
  command.add_option("--output", file, "Write to this file instead of the terminal");
}

void OutputOption::require_folder() const {
  if (file) require_folder_of(*file);
}

void OutputOption::write(const std::string& text) const {
  if (!file) return fmt::print("{}", text);
  write_file(*file, text);
  fmt::print("wrote {}\n", file->string());
}

std::string csv_lines(const Scene& scene, const State& state, double time, std::string_view more) {
  std::string text;
  for (std::size_t i = 1; i < scene.bodies.size(); ++i) {
    const Body& body = scene.bodies[i];
    if (body.is_kinematic()) continue;
    const Vector3& x = state.q[i].linear;
    const Quaternion r = state.q[i].angular * body.body_from_node.orientation;
    const Vector3& v = state.v[i].linear;
    const Vector3& w = state.v[i].angular;
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}{}\n", time,
                   csv_field(body.name), x.x(), x.y(), x.z(), r.w(), r.x(), r.y(), r.z(), v.x(), v.y(), v.z(),
                   w.x(), w.y(), w.z(), more);
  }
  return text;
}

}  // namespace substep
