#pragma once
/// Converts records of a sweep to JSON and to CSV tables.

#include <string>
#include <vector>

#include "sim/study/sweep.h"

namespace substep {

std::string to_json(const SweepRecord& record);
/// Throws Error for what is not a record.
SweepRecord record_in(const std::string& json);

/// Returns a CSV table: a header, then a line for each record, in SI units; missing values are empty.
std::string errors_csv(const std::vector<SweepRecord>& records);
std::string times_csv(const std::vector<SweepRecord>& records);

}  // namespace substep
