#pragma once
/// The commands of golden, one file each. A callback throws Error for bad input (exit code 2) and
/// CLI::RuntimeError(1) where the answer is no: pictures differ, a golden fails.

#include <CLI/CLI.hpp>

namespace substep {

void add_check_command(CLI::App& app);
void add_approve_command(CLI::App& app);
void add_replay_command(CLI::App& app);
void add_diff_command(CLI::App& app);
void add_init_command(CLI::App& app);
void add_review_command(CLI::App& app);

}  // namespace substep
