#pragma once
/// The commands that are printed for a case that fails: to approve it. They hold
/// from where the user stands, so they are made where they are printed, of results that may have been moved
/// since.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace substep::golden {

/// Which suite was checked and where its results lie, as commands name them.
struct ResultsLocation {
  std::filesystem::path suite;
  std::filesystem::path output;
};

/// Where commands printed for these results find suite and output: relative where they are below the working
/// folder, for that is what another machine has, too.
ResultsLocation location_of(const nlohmann::ordered_json& results, const std::filesystem::path& output);

/// A command in three parts, for the middle one is another when a report is opened elsewhere. All empty:
/// none.
struct ApproveCommand {
  std::string before;  ///< "substep approve box_stack.a4 --suite …"
  std::string output;  ///< " --output …", or nothing
  std::string after;   ///< " --reason \"...\""

  bool is_there() const { return !before.empty(); }
  std::string text() const { return before + output + after; }
};

struct CaseCommands {
  std::string files;       ///< the folder with the case's files
  ApproveCommand approve;  ///< none where it cannot be approved
};

/// `entry` is the case's part of results.json.
CaseCommands commands_of(const nlohmann::ordered_json& entry, const ResultsLocation& location);

/// Everything to be printed of a case that does not pass: what results.json says of it, then the commands.
std::string explanation(const nlohmann::ordered_json& entry, const ResultsLocation& location);

/// To approve these cases; all that failed where there are none.
ApproveCommand approve_command(const std::vector<std::string>& cases, const ResultsLocation& location);

/// As one word of a shell, whatever is in it.
std::string shell_word(const std::string& word);

}  // namespace substep::golden
