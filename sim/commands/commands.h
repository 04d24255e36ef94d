#pragma once
/// The commands of sim, one file each. A callback throws Error for bad input (exit code 2) and
/// CLI::RuntimeError(1) where the answer is no: a run diverged.

#include <CLI/CLI.hpp>

namespace substep {

void add_run_command(CLI::App& app);
void add_info_command(CLI::App& app);
void add_measure_command(CLI::App& app);
void add_sweep_command(CLI::App& app);
void add_mlcp_command(CLI::App& app);
/// To the command report.
void add_claims_command(CLI::App& report);
void add_published_command(CLI::App& report);

}  // namespace substep
