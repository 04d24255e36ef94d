#pragma once
/// The commands of sim. A callback throws Error for bad input (exit code 2), and CLI::RuntimeError(1) where a
/// run diverged, a problem was not solved or a reference could not be made.

#include <CLI/CLI.hpp>

namespace substep {

void add_run_command(CLI::App& app);
void add_info_command(CLI::App& app);
void add_measure_command(CLI::App& app);
void add_sweep_command(CLI::App& app);
// Commands below `report`:
void add_claims_command(CLI::App& report);
void add_published_command(CLI::App& report);
void add_mlcp_command(CLI::App& report);

}  // namespace substep
