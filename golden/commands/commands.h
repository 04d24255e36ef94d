#pragma once
/// The commands of golden. A callback throws Error for bad input and CLI::RuntimeError(1) where the answer is
/// no: pictures differ, a golden fails.

#include <CLI/CLI.hpp>

namespace substep::golden {

void add_check_command(CLI::App& app);
void add_approve_command(CLI::App& app);
void add_diff_command(CLI::App& app);
void add_init_command(CLI::App& app);

}  // namespace substep::golden
