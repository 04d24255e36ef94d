#include "sim/commands/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace substep {

Progress::Progress() : is_terminal_(::isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  clear();
}

void Progress::clear() {
  if (is_shown_) fmt::print(stderr, "\r\x1b[K");
  is_shown_ = false;
}

void Progress::show(std::string_view stage, double share) {
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
  std::string line = fmt::format("{} {:.0f} %", stage_, 100 * share);
  const double elapsed = std::chrono::duration<double>(now - stage_start_).count();
  // Before that the estimate would jump.
  if (elapsed > 0.5 && share > 0.01)
    line += fmt::format(", {:.0f} s left", std::ceil(elapsed * (1 - share) / share));
  fmt::print(stderr, "\r\x1b[K{}", line);
  std::fflush(stderr);
}

}  // namespace substep
