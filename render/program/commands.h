#pragma once
/// The commands of the program, one file each. A callback throws Error for bad input (exit code 2) and
/// CLI::RuntimeError(1) where the answer is no: pictures differ, a run diverged, a golden fails.

#include <CLI/CLI.hpp>

namespace substep {

void add_run_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_video_command(CLI::App& app);
void add_info_command(CLI::App& app);
void add_diff_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_approve_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_claims_command(CLI::App& app);
void add_measure_command(CLI::App& app);
void add_sweep_command(CLI::App& app);
void add_sheet_command(CLI::App& app);
void add_figure_command(CLI::App& app);
void add_report_command(CLI::App& app);

}  // namespace substep
