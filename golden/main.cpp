/// The program substep: simulates scenes with A1 to A5, renders the runs and compares them.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "golden/commands/commands.h"
#include "golden/compare/provenance.h"
#include "render/commands/commands.h"
#include "render/renderer.h"
#include "sim/commands/commands.h"
#include "sim/commands/process.h"
#include "sim/error.h"
#include "sim/model/settings_fields.h"

namespace substep {
namespace {

/// Prints the message in one line, since scripts and people read the last line. Returns the exit code.
int refuse(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "substep: {}\n", message);
  return bad_input;
}

/// Returns the number of letters to insert, delete, replace or swap with the next one.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector least(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = least[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      least[i][j] = std::min({replaced, least[i - 1][j] + 1, least[i][j - 1] + 1});
      const bool is_swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swapped) least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  }
  return least[a.size()][b.size()];
}

/// Returns the nearest of the names within two letters of what was typed, or "".
std::string nearest(const std::vector<std::string>& names, const std::string& typed) {
  const auto distance = [&](const std::string& name) { return edit_distance(name, typed); };
  const auto found = std::ranges::min_element(names, {}, distance);
  return found == names.end() || distance(*found) > 2 ? "" : *found;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* const command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

/// Returns the message on a command that does not exist, with the command that may have been meant.
std::string no_command(const CLI::App& app, const std::string& typed) {
  const std::string name = nearest(command_names(app), typed);
  return fmt::format("'{}' is no command: {}", typed,
                     name.empty() ? "'substep --help' lists them" : fmt::format("did you mean '{}'?", name));
}

/// Returns the message on arguments that cannot be parsed, with the option that may have been meant.
std::string complaint(const CLI::App& app, const std::vector<std::string>& words,
                      const CLI::ParseError& error) {
  if (app.get_subcommands().empty() && words[0][0] != '-') return no_command(app, words[0]);
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  std::vector<std::string> names;
  for (const CLI::Option* const option : command->get_options()) {
    if (!option->get_lnames().empty()) names.push_back("--" + option->get_lnames().front());
  }
  for (const std::string& word : words) {
    const std::string typed = word.substr(0, word.find('='));
    if (!typed.starts_with("--") || std::ranges::find(names, typed) != names.end()) continue;
    const std::string name = nearest(names, typed);
    if (!name.empty()) return fmt::format("{}: did you mean {}?", typed, name);
  }
  return fmt::format("{} (--help lists what can be given)", error.what());
}

int run(int argc, char** argv) {
  CLI::App app{
      "Simulates scenes with algorithms A1 to A5 of 'The Sub-stepping of Havok's Physics Solver',\n"
      "draws the runs and compares them. 'substep help COMMAND' describes a command,\n"
      "'substep help settings' the settings of the solver.",
      "substep"};
  app.footer("Example:\n  substep video scenes/box_stack.gltf      makes box_stack.mp4");
  app.set_version_flag("--version", [] { return "substep " + golden::made_with(false).version; });
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

  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) return refuse("a command is needed: 'substep --help' lists them");
  if (words == std::vector<std::string>{"help", "settings"}) {
    fmt::print("{}", settings_help());
    return 0;
  }
  // "help COMMAND" is "COMMAND --help".
  if (words[0] == "help") {
    words.erase(words.begin());
    const std::vector<std::string> names = command_names(app);
    const bool is_command = words.empty() || std::ranges::find(names, words[0]) != names.end();
    if (!is_command) return refuse(no_command(app, words[0]));
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
  } catch (const std::filesystem::filesystem_error& error) {
    return substep::refuse(fmt::format("{}: {}", error.path1().string(), error.code().message()));
  } catch (const std::bad_alloc&) {
    return substep::refuse_for_memory();
  } catch (const std::exception& error) {
    const bool is_output = std::ferror(stdout) != 0;
    return substep::refuse(is_output ? fmt::format("standard output: {}", error.what()) : error.what());
  }
}
