#pragma once
/// Output of commands: progress, warnings, texts on the terminal or in a file, and tables of states.

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/measure/metrics.h"
#include "sim/model/state.h"
#include "sim/scene/scene.h"

namespace substep {

/// A line on stderr with the current task, the percentage done and the time left. The destructor clears it.
/// Nothing is written where stderr is no terminal.
class Progress {
 public:
  Progress();
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(std::string_view stage, double fraction);  ///< shows that a fraction of the stage is done
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

/// Prints a line on stderr for each violation of the run that `label` names. Lines of violations that are
/// more than warnings begin with "not bounded".
void warn_of(const Scene& scene, const std::string& label, const std::vector<Violation>& violations);

/// The option --output of commands that print a text or write it to a file.
struct OutputOption {
  std::optional<std::filesystem::path> file;

  void add_to(CLI::App& command);
  /// Throws Error where the file's folder is missing or the file is a folder.
  void require_folder() const;
  /// Prints the text, or writes it and prints the file's name.
  void write(const std::string& text) const;
};

/// The columns of a table of states: seconds, a body's name, its centre of mass (m), the orientation of its
/// node, and its velocities (m/s, rad/s), in the world.
inline constexpr std::string_view csv_columns = "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";

/// Returns a line of these columns for each dynamic or pivoting body, followed by `more`. `time`: s.
std::string csv_lines(const Scene& scene, const State& state, double time, std::string_view more = "");

}  // namespace substep
