#pragma once
/// What cases mask, by regions and bodies, and what differs there: no failure, and not unsaid.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

namespace substep {

/// How many cases differ where they are masked, or in bodies that have tolerances of their own; of what
/// results.json holds.
std::size_t cases_that_differ_masked(const nlohmann::ordered_json& results);

/// A table for the report, what differs first; empty where nothing is masked.
std::string masked_table(const nlohmann::ordered_json& results);

}  // namespace substep
