#pragma once
/// The command that approves a failing case. It holds from the user's working folder: it is made where it is
/// printed, and the results may have been moved since the check.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace substep::golden {

/// The suite that was checked and the folder of its results, as commands name them.
struct ResultsLocation {
  std::filesystem::path suite;
  std::filesystem::path output;
};

/// Where commands printed for these results find suite and output: relative where they are below the working
/// folder, for that is what another machine has, too.
ResultsLocation location_of(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// Returns the command that approves a case, from its part of results.json: "substep approve box_stack.a4
/// --reason \"...\""; empty where it cannot be approved from there.
std::string approve_command(const nlohmann::ordered_json& entry, const ResultsLocation& location);

/// Returns all that is printed of a case that does not pass: its text in results.json, then the command.
std::string explanation(const nlohmann::ordered_json& entry, const ResultsLocation& location);

/// Returns `word` quoted, so that a shell takes it as one word.
std::string shell_word(const std::string& word);

}  // namespace substep::golden
