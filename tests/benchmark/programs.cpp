#include <sys/resource.h>

#include "sim/execution/child_process.h"
#include "tests/benchmark/measurement.h"

namespace substep::benchmark {
namespace {

/// CPU time of all programs that were started and have ended, with their own, s.
double cpu_time_of_children() {
  rusage usage;
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

void register_program(const std::vector<std::string>& arguments, int runs) {
  std::string name = "substep";
  for (const std::string& argument : arguments) name += " " + argument;
  const auto run = [=](::benchmark::State& state) {
    std::vector<std::string> words{SUBSTEP_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    bool passed = true;
    const double start = cpu_time_of_children();
    for (auto unused : state) {
      (void)unused;
      ChildProcess child(words, {ChildProcess::inherited, ChildProcess::nowhere, ChildProcess::nowhere});
      passed = child.succeeds() && passed;
    }
    const double taken = cpu_time_of_children() - start;
    state.counters["ms_of_program"] = 1e3 * taken / static_cast<double>(state.iterations());
    state.SetLabel(passed ? "ends with code 0"
                          : std::string(failed_check) + ": it ends with another code than 0");
  };
  ::benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(runs);
}

}  // namespace substep::benchmark
