/// substep: scenes through five solver algorithms, to pose logs, pictures and comparison videos.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>

#include "golden/commands/commands.h"
#include "golden/process.h"
#include "render/commands/commands.h"
#include "render/renderer.h"
#include "sim/commands/commands.h"
#include "sim/error.h"

namespace substep {
namespace {

/// One line, whatever is in the message: scripts and people read the last line.
int refuse(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "substep: {}\n", message);
  return golden::bad_input;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Scenes through the five algorithms A1 to A5 of 'The Sub-stepping of Havok's Physics Solver':\n"
      "simulated, drawn, compared. 'substep COMMAND --help' says more of each command.",
      "substep"};
  app.footer("Example:\n  substep video scenes/box_stack.gltf      makes box_stack.mp4");
  app.require_subcommand(1);
  add_run_command(app);
  render::add_render_command(app);
  render::add_video_command(app);
  render::add_player_command(app);
  render::add_export_command(app);
  add_info_command(app);
  golden::add_diff_command(app);
  golden::add_check_command(app);
  golden::add_approve_command(app);
  golden::add_init_command(app);
  add_measure_command(app);
  add_sweep_command(app);
  render::add_report_command(app);

  if (argc <= 1) return refuse("a command is needed: 'substep --help' lists them");
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& answer) {
    return answer.get_exit_code();
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    if (app.get_subcommands().empty() && argv[1][0] != '-') {
      return refuse(fmt::format("'{}' is no command: 'substep --help' lists them", argv[1]));
    }
    return refuse(std::string(error.what()) + " (--help lists what can be given)");
  }
  return 0;
}

}  // namespace
}  // namespace substep

int main(int argc, char** argv) {
  try {
    substep::prepare_process();
    substep::render::pin_renderer();
    const int code = substep::run(argc, argv);
    substep::flush_output();
    return code;
  } catch (const substep::Error& error) {
    return substep::refuse(error.what());
  } catch (const std::bad_alloc&) {
    return substep::refuse_for_memory();
  } catch (const std::exception& error) {
    const bool is_output = std::ferror(stdout) != 0;
    return substep::refuse(is_output ? fmt::format("standard output: {}", error.what()) : error.what());
  }
}
