/// The claim of cost: 7.

#include <fmt/format.h>

#include <algorithm>

#include "sim/algorithms.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/claims_sentences.h"
#include "sim/measure/solver_times.h"

namespace substep::claims {

Claim claim7(Measurement& measurement) {
  Claim claim = unmeasured_claim(7);
  const std::vector<Procedure> procedures{proc2, proc3, proc4, proc5};
  bool equal = true;
  bool near = true;
  bool faster = true;
  for (const char* name : {"rod_chain", "powered_wheel", "box_stack"}) {
    std::vector<Settings> all{settings_of(measurement.scene(name), Algorithm::a2, 1, 4)};
    for (const Algorithm a : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
      all.push_back(settings_of(measurement.scene(name), a, 4, 1, Joints::rows));
    }
    std::vector<double> solves;
    for (const Settings& settings : all) {
      Simulation simulation(measurement.scene(name), settings);
      solves.push_back(static_cast<double>(simulation.step().row_solves));
    }
    std::vector<std::vector<double>> times(all.size());
    for (int repetition = 0; repetition < 10; ++repetition) {
      const auto more = solver_times(measurement.scene(name), all, procedures, 60);
      for (std::size_t k = 0; k < all.size(); ++k)
        times[k].insert(times[k].end(), more[k].begin(), more[k].end());
    }
    const double a2 = median(times[0]);
    const double a3 = median(times[1]) / a2;
    const double a4 = median(times[2]) / a2;
    const double a5 = median(times[3]) / a2;
    claim.figures.push_back({name, {a3, a4, a5}, "", true});
    claim.figures.push_back({fmt::format("{}: row solves a step of each", name), {solves[0]}, ""});
    equal = equal && std::ranges::all_of(solves, [&](double v) { return v == solves[0]; });
    near = near && a3 < 1.25;
    faster = faster && a4 < a3 && a5 < a3;
  }
  claim.cases = {{"the same row solves", equal},
                 {"A3's time within a quarter of A2's", near, true},
                 {"A4 and A5 faster than A3", faster, true}};
  return claim;
}

}  // namespace substep::claims
