#pragma once
/// junit.xml: what CI services show of a check. Two tests a case, poses and images, as in the suite.

#include <filesystem>
#include <nlohmann/json.hpp>

namespace substep {

std::filesystem::path junit_file(const std::filesystem::path& output);

/// From results_json().
void write_junit(const nlohmann::ordered_json& results, const std::filesystem::path& output);

}  // namespace substep
