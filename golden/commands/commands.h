#pragma once
/// The commands of golden. A callback throws Error for bad input, and CLI::RuntimeError with
/// the exit code: 1 where runs differ or a golden fails, 3 where a check fails by its renderer alone.

#include <CLI/CLI.hpp>

namespace substep::golden {

void add_check_command(CLI::App& app);
void add_approve_command(CLI::App& app);
void add_diff_command(CLI::App& app);
void add_init_command(CLI::App& app);

}  // namespace substep::golden
