#pragma once
/// The report's claims about its algorithms, each measured.

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace substep {

/// A row of a claim's table: one number, or one for each of the claim's columns.
struct Figure {
  std::string what;            ///< "rod_chain, n = 4"
  std::vector<double> values;  ///< not finite where a run diverged
  std::string unit;            ///< "" for ratios and slopes
  bool timing = false;         ///< differs from run to run
};

/// A part of a claim that holds or not by itself.
struct Case {
  std::string what;
  bool holds;
};

struct Claim {
  int number;                             ///< 1 to 14 are the report's, 15 to 18 are ours
  std::string section;                    ///< of the report; "not the report's" for ours
  std::string claim;                      ///< in one sentence
  std::string measured;                   ///< scenes and settings
  std::vector<std::string> columns = {};  ///< titles of the values of figures with several values, with units
  std::vector<Figure> figures = {};
  std::vector<Case> cases = {};

  void add(std::string what, std::vector<double> values, std::string unit = "", bool timing = false) {
    figures.push_back({std::move(what), std::move(values), std::move(unit), timing});
  }
  void require(std::string what, bool holds) { cases.push_back({std::move(what), holds}); }

  /// Returns "holds", "does not hold", or the cases that hold or fail.
  std::string verdict() const;
};

/// Measures all claims on the scene files of `folder`: about half a minute. Returns, as Markdown, for each
/// claim its verdict, a table and a list, then the cost of each approximation between A3 and A5. All but
/// timings, which ~ marks, is the same in every run. No table has more than seven columns or two numbers in a
/// cell. `progress` receives the measured fraction. Throws Error when
/// a scene cannot be read.
std::string measure_claims(const std::filesystem::path& folder, const std::function<void(double)>& progress);

}  // namespace substep
