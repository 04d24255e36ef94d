#pragma once
/// Guesses at mistyped commands and options.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace substep {

bool is_command(const CLI::App& app, const std::string& name);

/// Returns ": did you mean 'render'?" for a command of `app` within two letters of `typed`; else "".
std::string command_like(const CLI::App& app, const std::string& typed);

/// Returns "--subteps: did you mean --substeps?" for the first of the words that begins with "--", is no
/// option of `command` and is within two letters of one; else "".
std::string option_like(const CLI::App& command, const std::vector<std::string>& words);

}  // namespace substep
