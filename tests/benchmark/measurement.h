#pragma once
/// Measures CPU time of steps, registered with Google Benchmark so that the engines of
/// a scene are timed in turns.

#include <benchmark/benchmark.h>

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sim/model/settings.h"
#include "tests/benchmark/benchmark_scenes.h"

namespace substep::benchmark {

/// CPU time of this thread, s.
double cpu_time();

/// An engine on a scene, ours or another; the benchmark's name is "scene/engine".
void register_steps(const BenchmarkScene& scene, const std::string& engine, const MakeStepper& make,
                    const Settings& settings);

/// Registers the cost of A1 by the size of its problem: rows, sets tried and time.
void register_cost_of_a1(const BenchmarkScene& scene);

/// Registers the times of the stages s1 to s4 (RunTimes, stage_times.h) over the scene's run.
void register_stages(const BenchmarkScene& scene, const std::string& engine, const Settings& settings);

/// Begins the remark on a result whose check fails.
inline constexpr std::string_view failed_check = "fails its check";

/// Medians over the repetitions, by name and figure: "pendulum/A1", "us_per_step".
class Results final : public ::benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override;  ///< puts the lines into the order of registration

  struct Line {
    std::int64_t place;  ///< in the order of registration
    std::string name;
    std::string remark;  ///< how the run was judged
    std::map<std::string, std::vector<double>> figures;
  };
  const std::vector<Line>& lines() const { return lines_; }
  /// Returns a figure, or NaN where it was not measured.
  double median(const std::string& name, const std::string& figure) const;
  bool failed(const std::string& name) const;

 private:
  std::vector<Line> lines_;
  const Line* line(const std::string& name) const;
};

// The tables are Markdown.

/// Returns a table of all figures; missing ones are blank.
std::string table(const Results& results);

/// The stages of steps, of the scenes registered for it; empty where none ran.
std::string stages(const Results& results);

/// A1's cost by size, of the scenes registered for it; empty where none ran.
std::string cost_of_a1(const Results& results);

/// Returns the exponents of A1's time over rows, from the smallest to the largest scene of each kind.
std::string exponents_of_a1(const Results& results);

}  // namespace substep::benchmark
