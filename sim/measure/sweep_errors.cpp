#include "sim/measure/sweep_errors.h"

#include <cmath>

#include "sim/loading/file_bytes.h"

namespace substep {

FrozenProblem load_frozen_problem(const std::filesystem::path& file) {
  constexpr std::uintmax_t largest = std::uintmax_t{1} << 28;  // bytes: 1000 contacts, dense, are 1.7e8
  return parse_frozen_problem(read_bytes(file, file.string(), largest), file.string());
}

std::vector<SweepError> sweep_errors(const FrozenProblem& problem, double tolerance) {
  constexpr int most = 4096;
  std::vector<SweepError> errors;
  std::vector<double> lambda;
  int done = 0;
  for (int sweeps = 1; sweeps <= most; sweeps *= 2) {
    sweep_rows(problem, lambda, sweeps - done);
    done = sweeps;
    errors.push_back({sweeps, cone_error(problem, lambda).natural_map});
    if (!(errors.back().error > tolerance) || !std::isfinite(errors.back().error)) break;
  }
  return errors;
}

}  // namespace substep
