#pragma once
/// Records of a sweep as JSON, and as lines of the tables for people who plot.

#include <string>
#include <vector>

#include "sim/study/sweep.h"

namespace substep {

std::string to_json(const SweepRecord& record);
/// Throws Error for what is not a record.
SweepRecord record_in(const std::string& json);

/// A line a record, a head above; SI units; empty where there is nothing.
std::string errors_csv(const std::vector<SweepRecord>& records);
std::string times_csv(const std::vector<SweepRecord>& records);

}  // namespace substep
