#pragma once
/// junit.xml: what CI services show of a check. Two tests a case, poses and images, as in the suite.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace substep::golden {

std::filesystem::path junit_file(const std::filesystem::path& output);

/// Of what results.json holds. A case that could not be checked is an error; so is a check that has not
/// ended, of all that it has not come to.
void write_junit(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Of a check that could not begin or go on, for what `why` says.
void write_failed_junit(const std::string& why, const std::filesystem::path& output);

}  // namespace substep::golden
