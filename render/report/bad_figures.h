#pragma once
/// Where runs miss what is known of their scenes.

#include <string>
#include <vector>

#include "render/report/document.h"
#include "sim/measure/text_table.h"
#include "sim/study/sweep.h"

namespace substep::report {

/// The worst figure of one algorithm in one scene, over all settings that ran.
struct BadFigure {
  std::string scene;
  Algorithm algorithm = Algorithm::a1;
  std::string label;  ///< the settings
  ExpectedFigure figure;
  int bad = 0;   ///< settings with a bad figure
  int runs = 0;  ///< settings that ran

  /// The error in tolerances; infinite where there is no value.
  double severity() const { return figure.error() / figure.tolerance; }
};

/// Of each scene and algorithm with a bad figure, the worst first.
std::vector<BadFigure> bad_figures(const std::vector<SweepRecord>& records);

/// Runs of ours that were compared with something known.
int judged_runs(const std::vector<SweepRecord>& records);

TextTable bad_figures_table(const std::vector<BadFigure>& figures);

/// A heading with that table; nothing where nothing is bad.
void add_bad_figures(const std::vector<SweepRecord>& records, Document& page);

}  // namespace substep::report
