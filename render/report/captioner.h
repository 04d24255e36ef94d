#pragma once
/// The part of a figure's caption that says what its lines' runs are, made from those that are drawn.

#include <map>
#include <set>
#include <string>

#include "render/report/plot.h"
#include "sim/study/sweep_results.h"

namespace substep::report {

/// The values that a line's runs have.
struct LineValues {
  std::string name;  ///< "A3", or the engine's
  std::string title;
  std::set<int> substeps, iterations, divisions;
};

/// Collects what the lines of a sheet show, for its caption and for shorter titles.
class Captioner {
 public:
  void add(const RunFamily& family);
  /// Gives algorithms that have one line by name alone that name, and adds to the caption what each line's
  /// runs are.
  void finish(Sheet& sheet) const;

 private:
  const std::string& short_title(const LineValues& line) const;

  std::map<std::string, LineValues> lines_;              ///< by title
  std::map<std::string, std::set<std::string>> titles_;  ///< by name
};

}  // namespace substep::report
