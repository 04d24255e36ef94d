#include "sim/measure/claims.h"

#include <string>
#include <utility>

#include "sim/measure/claims_measurement.h"

namespace substep {

ClaimsReport measure_claims(const std::filesystem::path& folder, const std::function<void(int)>& progress) {
  claims::Measurement measurement(folder);
  ClaimsReport report;
  for (const auto claim :
       {&claims::claim1, &claims::claim2, &claims::claim3, &claims::claim4, &claims::claim5, &claims::claim6,
        &claims::claim7, &claims::claim8, &claims::claim9, &claims::claim10, &claims::claim11,
        &claims::claim12, &claims::claim13, &claims::claim14, &claims::claim15, &claims::claim16,
        &claims::claim17}) {
    progress(static_cast<int>(report.claims.size()) + 1);
    report.claims.push_back(claim(measurement));
  }
  // The heavy chain needs more sub-steps to stay a chain at all.
  for (const auto& [name, n] : {std::pair{"pendulum", 4},
                                {"rod_chain", 4},
                                {"tumbling rod_chain", 4},
                                {"heavy_chain", 16},
                                {"powered_wheel", 4}}) {
    report.ablation.push_back(claims::ablation(measurement, name, n));
  }
  report.energy_scenes = {"pendulum", "rod_chain", "heavy_chain"};
  const auto add_energy = [&](const std::string& run, Algorithm algorithm, Joints joints) {
    report.energy.push_back(claims::energy_drift(measurement, run, algorithm, joints, report.energy_scenes));
  };
  add_energy("A1", Algorithm::a1, Joints::plain);
  add_energy("A2, m = 4", Algorithm::a2, Joints::plain);
  for (const Algorithm algorithm : {Algorithm::a3, Algorithm::a4, Algorithm::a5}) {
    for (const Joints joints : {Joints::plain, Joints::stable}) {
      const std::string number(1, name(algorithm)[1]);
      add_energy("A" + number + ", " + std::string(name(joints)), algorithm, joints);
    }
  }
  return report;
}

}  // namespace substep
