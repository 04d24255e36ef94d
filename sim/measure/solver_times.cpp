#include "sim/measure/solver_times.h"

#include <algorithm>
#include <chrono>

#include "sim/algorithms.h"

namespace substep {

std::vector<std::vector<double>> solver_times(const Scene& scene, const std::vector<Settings>& all,
                                              const std::vector<Procedure>& procedures, int steps) {
  std::vector<std::vector<double>> times(all.size());
  std::vector<Simulation> simulations;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto timed = [&times, k, procedure = procedures[k]](CoordinateVector& q, VelocityVector& v,
                                                              const Settings& settings, Problem& problem,
                                                              Work& work) {
      using Clock = std::chrono::steady_clock;
      const Clock::time_point start = Clock::now();
      procedure(q, v, settings, problem, work);
      times[k].push_back(std::chrono::duration<double>(Clock::now() - start).count());
    };
    simulations.emplace_back(scene, all[k], timed);
  }
  for (int i = 0; i < steps; ++i) {
    for (Simulation& simulation : simulations) simulation.step();
  }
  return times;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace substep
