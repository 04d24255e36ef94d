#pragma once
/// The commands of render, one file each. A callback throws Error for bad input, which ends the program with
/// code 2.

#include <CLI/CLI.hpp>

namespace substep::render {

void add_render_command(CLI::App& app);
void add_video_command(CLI::App& app);
void add_player_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_report_command(CLI::App& app);

}  // namespace substep::render
