/// Claims of smaller errors and of costs: 3, 6, 7, 13 and 14, and the cost of each approximation.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "sim/algorithms.h"
#include "sim/measure/claims_measurement.h"
#include "sim/measure/validity_maps.h"

namespace substep::claims {
namespace {

/// Adds the least and the largest of some ratios of times.
void add_time_ratios(const std::string& what, const std::string& unit, const std::vector<double>& ratios,
                     Claim& claim) {
  claim.figures.push_back({what + ", least", {std::ranges::min(ratios)}, unit, true});
  claim.figures.push_back({what + ", most", {std::ranges::max(ratios)}, unit, true});
}

}  // namespace

/// A scene of claim 3, and how many sweeps A2 makes in the solver time of a sub-step of A3, rounded up: what
/// they come to is among the claim's figures.
struct ComparedScene {
  const char* name;
  int sweeps;
};

/// A3's solver time with 16 sub-steps of single rows, over A2's with so many sweeps for each.
double time_beside_sweeps(const Scene& scene, int sweeps) {
  constexpr int n = 16;
  const std::vector<Settings> both{settings_of(scene, Algorithm::a3, n, 1, Joints::rows),
                                   settings_of(scene, Algorithm::a2, 1, sweeps * n)};
  const auto times = solver_times(scene, both, {proc3, proc2}, 60);
  return median(times[0]) / median(times[1]);
}

Claim claim3(Measurement& measurement) {
  Claim claim = unmeasured_claim(3);
  std::vector<double> ratios;
  for (const ComparedScene& scene : {ComparedScene{"pendulum", 8},
                                     {"rod_chain", 3},
                                     {"heavy_chain", 3},
                                     {"powered_wheel", 5},
                                     {"box_stack", 3},
                                     {"stone_pyramid", 3},
                                     {"card_house", 3}}) {
    const std::string name = scene.name;
    Figure errors{name, {}, ""};
    for (const int n : {4, 16}) {
      const double substeps = measurement.error(name, Algorithm::a3, n, 1, Joints::rows);
      const double equal_rows = measurement.error(name, Algorithm::a2, 1, n, Joints::rows);
      const double equal_time = measurement.error(name, Algorithm::a2, 1, scene.sweeps * n, Joints::rows);
      const std::string what = fmt::format("{}, n = {}", name, n);
      errors.values.insert(errors.values.end(), {substeps, equal_rows, equal_time});
      claim.cases.push_back({what, substeps < equal_rows});
      claim.cases.push_back({fmt::format("at equal time {}", what), substeps < equal_time});
    }
    claim.figures.push_back(std::move(errors));
    ratios.push_back(time_beside_sweeps(measurement.scene(name), scene.sweeps));
  }
  add_time_ratios("solver time of A3 over A2's at equal time, n = 16", "", ratios, claim);
  return claim;
}

Claim claim6(Measurement& measurement) {
  Claim claim = unmeasured_claim(6);
  std::map<int, double> a4;
  std::map<int, double> a5;
  for (const int n : {4, 16, 64, 256}) {
    a4[n] = measurement.error("rod_chain", Algorithm::a4, n, 1, Joints::stable);
    a5[n] = measurement.error("rod_chain", Algorithm::a5, n, 1, Joints::stable);
    claim.figures.push_back({fmt::format("n = {}", n), {a4[n], a5[n]}, ""});
  }
  claim.cases.push_back(
      {"A5 above A4 from n = 16 on", a5[16] > a4[16] && a5[64] > a4[64] && a5[256] > a4[256]});
  claim.cases.push_back({"A4 still falling by more than half from n = 16 to 64", a4[64] < 0.5 * a4[16]});
  claim.cases.push_back({"A5 not falling by half from n = 16 to 256", a5[256] > 0.5 * a5[16]});
  return claim;
}

Claim claim13(Measurement& measurement) {
  Claim claim = unmeasured_claim(13);
  const std::vector<std::string> names{"pendulum", "rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const MeasuredRun blocks = measurement.run(name, Algorithm::a3, n, 1, Joints::plain);
      const MeasuredRun rows = measurement.run(name, Algorithm::a3, n, 1, Joints::rows);
      const double block_error = error_of(blocks, measurement.reference(name));
      const double row_error = error_of(rows, measurement.reference(name));
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.figures.push_back({what, {block_error, row_error, blocks.largest_gap, rows.largest_gap}, ""});
      claim.cases.push_back({"error on " + what, block_error < row_error});
      claim.cases.push_back({"gap on " + what, blocks.largest_gap < rows.largest_gap});
    }
  }
  std::vector<double> ratios;
  for (const std::string& name : names) {
    const std::vector<Settings> all{settings_of(measurement.scene(name), Algorithm::a3, 16, 1, Joints::plain),
                                    settings_of(measurement.scene(name), Algorithm::a3, 16, 1, Joints::rows)};
    const auto times = solver_times(measurement.scene(name), all, {proc3, proc3}, 120);
    ratios.push_back(median(times[0]) / median(times[1]));
  }
  add_time_ratios("solver time of blocks, n = 16", "× that of rows", ratios, claim);
  return claim;
}

Claim claim14(Measurement& measurement) {
  Claim claim = unmeasured_claim(14);
  const std::vector<std::string> names{"rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const auto measure = [&](Algorithm algorithm, Joints joints) {
        MeasuredRun result = measurement.run(name, algorithm, n, 1, joints);
        claim.figures.push_back(
            {fmt::format("{}, n = {}: {} {}", name, n, title_of(algorithm), substep::name(joints)),
             {error_of(result, measurement.reference(name)), result.largest_gap, result.energy_change},
             ""});
        return result;
      };
      const MeasuredRun exact = measure(Algorithm::a3, Joints::plain);
      const MeasuredRun plain = measure(Algorithm::a4, Joints::plain);
      const MeasuredRun stable4 = measure(Algorithm::a4, Joints::stable);
      const MeasuredRun stable5 = measure(Algorithm::a5, Joints::stable);
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.cases.push_back({"gaps by frozen ones, " + what, plain.largest_gap > exact.largest_gap});
      for (const auto& [algorithm, stable] :
           {std::pair{Algorithm::a4, &stable4}, {Algorithm::a5, &stable5}}) {
        claim.cases.push_back({fmt::format("gaps mended in {}, {}", title_of(algorithm), what),
                               stable->largest_gap < plain.largest_gap});
        claim.cases.push_back({fmt::format("damping by {}, {}", title_of(algorithm), what),
                               stable->energy_change < std::min(0.0, exact.energy_change)});
      }
    }
  }
  return claim;
}

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
    equal = equal && std::ranges::all_of(solves, [&](double v) { return v == solves[0]; });
    near = near && a3 < 1.25;
    faster = faster && a4 < a3 && a5 < a3;
  }
  claim.cases = {{"the same row solves", equal},
                 {"A3's time within a quarter of A2's", near},
                 {"A4 and A5 faster than A3", faster}};
  return claim;
}

AblationCosts ablation(const Measurement& measurement, const std::string& name, int n) {
  return {name, n, ablation_costs(measurement.scene(name), n, horizon)};
}

}  // namespace substep::claims
