/// Claims of smaller errors and of costs: 3, 6, 7, 13 and 14.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "sim/algorithms.h"
#include "sim/measure/claims_measurement.h"

namespace substep::claims {
namespace {

/// Adds the least and the largest ratio of times to the claim's figures.
void add_time_ratios(const std::string& what, const std::string& unit, const std::vector<double>& ratios,
                     Claim& claim) {
  claim.add(what + ", least", {std::ranges::min(ratios)}, unit, true);
  claim.add(what + ", most", {std::ranges::max(ratios)}, unit, true);
}

/// Returns the median times of the solver alone (s3, s4) in a step, s, of several procedures that step in
/// turn. Times differ from run to run.
std::vector<double> median_times(const Scene& scene, const std::vector<Settings>& all,
                                 const std::vector<Procedure>& procedures, int steps, int repetitions = 1) {
  std::vector<std::vector<double>> times(all.size());
  for (int repetition = 0; repetition < repetitions; ++repetition) {
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
  }
  std::vector<double> medians;
  for (std::vector<double>& values : times) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    medians.push_back(*middle);
  }
  return medians;
}

/// A scene of claim 3, and the sweeps that A2 makes in the solver time of a sub-step of A3, rounded up. The
/// claim's figures have the ratio of the times.
struct ComparedScene {
  const char* name;
  int sweeps;
};

/// Returns A3's solver time with 16 sub-steps of single rows, over A2's with so many sweeps for each.
double time_beside_sweeps(const Scene& scene, int sweeps) {
  constexpr int n = 16;
  const std::vector<Settings> both{settings_of(scene, Algorithm::a3, n, 1, Joints::rows),
                                   settings_of(scene, Algorithm::a2, 1, sweeps * n)};
  const std::vector<double> times = median_times(scene, both, {proc3, proc2}, 60);
  return times[0] / times[1];
}

}  // namespace

Claim claim3(Measurement& measurement) {
  Claim claim{
      3,
      "IV.2.2",
      "At equal row solves, n sub-steps beat n iterations: Γ̂¹(t,h,n) is better than Γ̂ⁿ(t,h)",
      "Errors at 1 s in metres, with one iteration, single rows, τ = κ = 1 and equal h. A2 makes n sweeps; "
      "at equal time as many as fit in the solver time of A3, 3 to 8 n, or fewer where it converges before",
      {"A3, n = 4", "A2, n sweeps", "A2, equal time", "A3, n = 16", "A2, n sweeps", "A2, equal time"}};
  std::vector<double> ratios;
  int wins_at_equal_time = 0;
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
      errors.values.insert(errors.values.end(), {substeps, equal_rows, equal_time});
      claim.require(fmt::format("{}, n = {}", name, n), substeps < equal_rows);
      wins_at_equal_time += substeps < equal_time;
    }
    claim.figures.push_back(std::move(errors));
    ratios.push_back(time_beside_sweeps(measurement.scene(name), scene.sweeps));
  }
  claim.add(fmt::format("at equal time A3 errs less, of {} cases", 2 * claim.figures.size()),
            {static_cast<double>(wins_at_equal_time)});
  add_time_ratios("solver time of A3 over A2's at equal time, n = 16", "", ratios, claim);
  return claim;
}

Claim claim6(Measurement& measurement) {
  Claim claim{6,
              "IV.4.1",
              "With recomputed Jacobians A5 is worse than A4: its error stops falling where A4's goes on",
              "Errors at 1 s on rod_chain with stable joints and m = 1",
              {"A4, m", "A5, m"}};
  std::map<int, double> a4;
  std::map<int, double> a5;
  for (const int n : {4, 16, 64, 256}) {
    a4[n] = measurement.error("rod_chain", Algorithm::a4, n, 1, Joints::stable);
    a5[n] = measurement.error("rod_chain", Algorithm::a5, n, 1, Joints::stable);
    claim.add(fmt::format("n = {}", n), {a4[n], a5[n]});
  }
  claim.require("A5 above A4 from n = 16 on", a5[16] > a4[16] && a5[64] > a4[64] && a5[256] > a4[256]);
  claim.require("A4 still falling by more than half from n = 16 to 64", a4[64] < 0.5 * a4[16]);
  claim.require("A5 not falling by half from n = 16 to 256", a5[256] > 0.5 * a5[16]);
  return claim;
}

Claim claim13(Measurement& measurement) {
  Claim claim{13,
              "IV.2.2",
              "Blocks help: 3×3 blocks beat single rows at equal cost",
              "A3 with m = 1 after 1 s at equal row solves, in m",
              {"error of blocks", "error of rows", "gap of blocks", "gap of rows"}};
  const std::vector<std::string> names{"pendulum", "rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const MeasuredRun blocks = measurement.run(name, Algorithm::a3, n, 1, Joints::plain);
      const MeasuredRun rows = measurement.run(name, Algorithm::a3, n, 1, Joints::rows);
      const double block_error = error_of(blocks, measurement.reference(name));
      const double row_error = error_of(rows, measurement.reference(name));
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.add(what, {block_error, row_error, blocks.largest_gap, rows.largest_gap});
      claim.require("error on " + what, block_error < row_error);
      claim.require("gap on " + what, blocks.largest_gap < rows.largest_gap);
    }
  }
  std::vector<double> ratios;
  for (const std::string& name : names) {
    const std::vector<Settings> all{settings_of(measurement.scene(name), Algorithm::a3, 16, 1, Joints::plain),
                                    settings_of(measurement.scene(name), Algorithm::a3, 16, 1, Joints::rows)};
    const std::vector<double> times = median_times(measurement.scene(name), all, {proc3, proc3}, 120);
    ratios.push_back(times[0] / times[1]);
  }
  add_time_ratios("solver time of blocks, n = 16", "× that of rows", ratios, claim);
  return claim;
}

Claim claim14(Measurement& measurement) {
  Claim claim{14,
              "IV.3.2",
              "Frozen Jacobians open joints; next-frame Jacobians close them, at the cost of damping",
              "m = 1, after 1 s",
              {"error, m", "joint gap, m", "change of energy, J"}};
  const std::vector<std::string> names{"rod_chain", "heavy_chain"};
  for (const std::string& name : names) {
    for (const int n : {4, 16}) {
      const auto measure = [&](Algorithm algorithm, Joints joints) {
        MeasuredRun result = measurement.run(name, algorithm, n, 1, joints);
        claim.add(fmt::format("{}, n = {}: {} {}", name, n, title_of(algorithm), substep::name(joints)),
                  {error_of(result, measurement.reference(name)), result.largest_gap, result.energy_change});
        return result;
      };
      const MeasuredRun exact = measure(Algorithm::a3, Joints::plain);
      const MeasuredRun plain = measure(Algorithm::a4, Joints::plain);
      const MeasuredRun stable4 = measure(Algorithm::a4, Joints::stable);
      const MeasuredRun stable5 = measure(Algorithm::a5, Joints::stable);
      const std::string what = fmt::format("{}, n = {}", name, n);
      claim.require("gaps by frozen ones, " + what, plain.largest_gap > exact.largest_gap);
      for (const auto& [algorithm, stable] :
           {std::pair{Algorithm::a4, &stable4}, {Algorithm::a5, &stable5}}) {
        claim.require(fmt::format("gaps mended in {}, {}", title_of(algorithm), what),
                      stable->largest_gap < plain.largest_gap);
        claim.require(fmt::format("damping by {}, {}", title_of(algorithm), what),
                      stable->energy_change < std::min(0.0, exact.energy_change));
      }
    }
  }
  return claim;
}

Claim claim7(Measurement& measurement) {
  Claim claim{7,
              "IV.2.2, IV.3",
              "A3 costs about as much as A2 with n iterations; A4 and A5 cost less than A3",
              "Median solver times over A2's at equal row solves, with n = 4 and single rows",
              {"A3", "A4", "A5"}};
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
    const std::vector<double> times =
        median_times(measurement.scene(name), all, {proc2, proc3, proc4, proc5}, 60, 10);
    const double a3 = times[1] / times[0];
    const double a4 = times[2] / times[0];
    const double a5 = times[3] / times[0];
    claim.add(name, {a3, a4, a5}, "", true);
    equal = equal && std::ranges::all_of(solves, [&](double v) { return v == solves[0]; });
    near = near && a3 < 1.25;
    faster = faster && a4 < a3 && a5 < a3;
  }
  claim.cases = {{"the same row solves", equal},
                 {"A3's time within a quarter of A2's", near},
                 {"A4 and A5 faster than A3", faster}};
  return claim;
}

}  // namespace substep::claims
