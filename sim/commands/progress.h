#pragma once
/// A line on the terminal with the current task and the time left.

#include <chrono>
#include <string>
#include <string_view>

namespace substep {

/// Writes to stderr, and only where that is a terminal. Clears its line at its end.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(std::string_view stage, double share);

  /// Clears the line, so that another can be printed; the next show() draws it again.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  bool is_terminal_;
  bool is_shown_ = false;
  std::string stage_;
  Clock::time_point stage_start_;
  Clock::time_point last_shown_;
};

}  // namespace substep
