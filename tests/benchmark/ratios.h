#pragma once
/// Ratios of times that compare our algorithms with other engines and with themselves.

#include <string>

#include "tests/benchmark/measurement.h"

namespace substep::benchmark {

/// Returns the ratios that this run measured both sides of, as a table in Markdown. Its last column names
/// those that failed their check.
std::string ratios(const Results& results);

}  // namespace substep::benchmark
