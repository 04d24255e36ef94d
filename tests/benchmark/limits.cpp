// The machine's own limits, for the goal of the kernel: measured, not looked up.

#include <immintrin.h>

#include <algorithm>

#include "sim/simulation.h"
#include "tests/benchmark/measurement.h"

namespace substep::benchmark {
namespace {

/// A contact row's numbers: angular 2 × 3, β, 1/Γ, a limit, the impulse; and two bodies' indices. Its
/// direction is that of its manifold, and M⁻¹Jᵀ follows.
constexpr double bytes_of_row = (6 + 4) * 8 + 8;
/// J v: 3 − and 9 × and 8 +; the clamped total: 6; M⁻¹Jᵀλ: 20 × and 12 +.
constexpr double operations_of_row = 20 + 6 + 32;
constexpr int lanes = 4;
constexpr int chains = 10;  // independent ones, to hide the latency

double sum(const std::vector<double>& numbers) {
  __m128d total[8];
  for (__m128d& one : total) one = _mm_setzero_pd();
  for (std::size_t i = 0; i + 16 <= numbers.size(); i += 16) {
    for (int k = 0; k < 8; ++k) total[k] = _mm_add_pd(total[k], _mm_loadu_pd(&numbers[i + 2 * k]));
  }
  for (int k = 1; k < 8; ++k) total[0] = _mm_add_pd(total[0], total[k]);
  return _mm_cvtsd_f64(total[0]);
}

/// Operations a second: of fused multiply-adds four wide where there are any, else of pairs two wide.
__attribute__((target("avx2,fma"))) double fused(int rounds) {
  __m256d x[chains];
  for (int k = 0; k < chains; ++k) x[k] = _mm256_set1_pd(k);
  const __m256d factor = _mm256_set1_pd(0.5);
  const __m256d addend = _mm256_set1_pd(1);
  for (int i = 0; i < rounds; ++i) {
    for (__m256d& one : x) one = _mm256_fmadd_pd(one, factor, addend);
  }
  for (int k = 1; k < chains; ++k) x[0] = _mm256_add_pd(x[0], x[k]);
  return _mm256_cvtsd_f64(x[0]);
}

double separate(int rounds) {
  __m128d x[chains];
  for (int k = 0; k < chains; ++k) x[k] = _mm_set1_pd(k);
  const __m128d factor = _mm_set1_pd(0.5);
  const __m128d addend = _mm_set1_pd(1);
  for (int i = 0; i < rounds; ++i) {
    for (__m128d& one : x) one = _mm_add_pd(_mm_mul_pd(one, factor), addend);
  }
  for (int k = 1; k < chains; ++k) x[0] = _mm_add_pd(x[0], x[k]);
  return _mm_cvtsd_f64(x[0]);
}

}  // namespace

void register_limits(const BenchmarkScene& scene, const Settings& settings) {
  const auto run = [=](::benchmark::State& state) {
    Simulation simulation(scene.scene, settings);
    int rows = 0;
    for (int i = 0; i < scene.steps; ++i) rows = simulation.step().rows;
    const std::vector<double> numbers(static_cast<std::size_t>(rows * bytes_of_row / 8), 1.0);
    const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    constexpr int rounds = 10000;
    double streaming = 0;
    double computing = 0;
    for (auto unused : state) {
      (void)unused;
      const double start = cpu_time();
      for (int i = 0; i < 10; ++i) ::benchmark::DoNotOptimize(sum(numbers));
      const double middle = cpu_time();
      ::benchmark::DoNotOptimize(wide ? fused(rounds) : separate(rounds));
      const double end = cpu_time();
      streaming += (middle - start) / (10.0 * rows);
      computing += (end - middle) * operations_of_row / (2.0 * (wide ? lanes : 2) * chains * rounds);
      state.SetIterationTime(end - start);
    }
    state.counters["ns_per_row_solve"] =
        1e9 * std::max(streaming, computing) / static_cast<double>(state.iterations());
    state.SetLabel(streaming > computing ? "memory is the limit" : "arithmetic is the limit");
  };
  ::benchmark::RegisterBenchmark((scene.name + "/row solves at the machine's limit").c_str(), run)
      ->UseManualTime();
}

}  // namespace substep::benchmark
