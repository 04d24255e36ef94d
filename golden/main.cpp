/// substep: scenes through five solver algorithms, to pose logs, pictures and comparison videos.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "golden/commands/commands.h"
#include "render/commands/commands.h"
#include "render/renderer.h"
#include "sim/commands/commands.h"
#include "sim/commands/did_you_mean.h"
#include "sim/commands/process.h"
#include "sim/error.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

/// One line, whatever is in the message: scripts and people read the last line.
int refuse(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "substep: {}\n", message);
  return bad_input;
}

std::string no_command(const CLI::App& app, const std::string& typed) {
  const std::string guess = command_like(app, typed);
  return fmt::format("'{}' is no command{}", typed, guess.empty() ? ": 'substep --help' lists them" : guess);
}

/// Says what cannot be understood, and what may have been meant.
std::string complaint(const CLI::App& app, const std::vector<std::string>& words,
                      const CLI::ParseError& error) {
  if (app.get_subcommands().empty() && words[0][0] != '-') return no_command(app, words[0]);
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  const std::string guess = option_like(*command, words);
  return guess.empty() ? fmt::format("{} (--help lists what can be given)", error.what()) : guess;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Scenes through the five algorithms A1 to A5 of 'The Sub-stepping of Havok's Physics Solver':\n"
      "simulated, drawn, compared. 'substep help COMMAND' says more of each command,\n"
      "'substep help settings' of the settings of solving.",
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
  add_mlcp_command(app);
  render::add_report_command(app);

  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) return refuse("a command is needed: 'substep --help' lists them");
  if (words == std::vector<std::string>{"help", "settings"}) {
    fmt::print("{}", settings_help());
    return 0;
  }
  // "help COMMAND" is "COMMAND --help".
  if (words[0] == "help") {
    words.erase(words.begin());
    if (!words.empty() && !is_command(app, words[0])) return refuse(no_command(app, words[0]));
    words.emplace_back("--help");
  }
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::RuntimeError& answer) {
    return answer.get_exit_code();
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return refuse(complaint(app, words, error));
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
